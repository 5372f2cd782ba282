"""Display options: light or dark, scale of forces, optional elements."""

from __future__ import annotations

from typing import Any

import viser

from slipgrasp.web.model.appearance import LARGEST_FORCE_SCALE, LEAST_FORCE_SCALE, Appearance
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.picture import SetAppearance, ToggleDark, ToggleLecture
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.keys import keys_of

_FORCE_STEP = 0.5


class AppearancePanel:
    """Panel of display options.

    Args:
        gui: Parent of the widgets.
        appearance: Initial options.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, appearance: Appearance, send: Send) -> None:
        self._send = send
        with gui.add_folder("Picture", expand_by_default=False):
            self.dark = gui.add_checkbox(
                "dark", appearance.dark, hint="Dark page and dark scene, for dim light."
            )
            self.force_scale = gui.add_slider(
                "force scale",
                LEAST_FORCE_SCALE,
                LARGEST_FORCE_SCALE,
                _FORCE_STEP,
                appearance.force_scale,
                hint="Scale of the arrows of the contact forces.",
            )
            self.cones = gui.add_checkbox(
                "friction cones",
                appearance.cones,
                hint="Draw the friction cone, which contains the force while a fingertip sticks, "
                "and dashed its estimate.",
            )
            self.lenses = gui.add_checkbox(
                "close-ups", appearance.lenses, hint="Show every contact magnified above the hand."
            )
            self.whole_hand = gui.add_checkbox(
                "whole hand",
                appearance.whole_hand,
                hint="Include the fingers with their mounts in the view, not only the object.",
            )
            self.lecture = gui.add_checkbox(
                "lecture",
                appearance.lecture,
                hint="Show only the view, the timeline, the outcome and one chart, in large type "
                f"(key {keys_of(ToggleLecture())}). The other keys still work.",
            )
        command = gui.add_command("Light or dark page", icon=viser.Icon.MOON)
        command.on_trigger(lambda _: send(ToggleDark()))
        for widget in (
            self.dark,
            self.force_scale,
            self.cones,
            self.lenses,
            self.whole_hand,
            self.lecture,
        ):
            widget.on_update(self._pass_on)

    def update(self, view: ViewState) -> None:
        """Shows the current options."""
        appearance = view.appearance
        self.dark.value = appearance.dark
        self.force_scale.value = appearance.force_scale
        self.cones.value, self.lenses.value = appearance.cones, appearance.lenses
        self.whole_hand.value, self.lecture.value = appearance.whole_hand, appearance.lecture

    # In the viewer server's event loop, which preserves the order of events.
    async def _pass_on(self, event: viser.GuiEvent[Any]) -> None:
        """Sends changes by the user; changes by the program are ignored."""
        if event.client_id is not None:
            self._send(
                SetAppearance(
                    Appearance(
                        dark=bool(self.dark.value),
                        force_scale=float(self.force_scale.value),
                        cones=bool(self.cones.value),
                        lenses=bool(self.lenses.value),
                        whole_hand=bool(self.whole_hand.value),
                        lecture=bool(self.lecture.value),
                    )
                )
            )
