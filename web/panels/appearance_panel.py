"""How the picture looks: light or dark, how long forces are, what is drawn."""

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
    """Lets the user choose what is drawn.

    Args:
        gui: Where it goes.
        appearance: What is chosen at first.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, appearance: Appearance, send: Send) -> None:
        self._send = send
        self._folder = gui.add_folder("Picture", expand_by_default=False)
        with self._folder:
            self.dark = gui.add_checkbox(
                "dark", appearance.dark, hint="Dark page and dark scene, for dim light."
            )
            self.force_scale = gui.add_slider(
                "force scale",
                LEAST_FORCE_SCALE,
                LARGEST_FORCE_SCALE,
                _FORCE_STEP,
                appearance.force_scale,
                hint="How many times longer than usual the arrows of the contact forces are.",
            )
            self.cones = gui.add_checkbox(
                "friction cones",
                appearance.cones,
                hint="Draw the cone that a force may not leave while its fingertip sticks, and "
                "dashed its estimate.",
            )
            self.lenses = gui.add_checkbox(
                "close-ups", appearance.lenses, hint="Show every contact magnified above the hand."
            )
            self.whole_hand = gui.add_checkbox(
                "whole hand",
                appearance.whole_hand,
                hint="Look at the fingers as far as their mounts, not at what is held alone.",
            )
            self.lecture = gui.add_checkbox(
                "lecture",
                appearance.lecture,
                hint="Picture, strip and one chart alone, in large type. "
                f"Key: {keys_of(ToggleLecture())}; others push, wet a face and pour.",
            )
        self._command = gui.add_command("Light or dark page", icon=viser.Icon.MOON)
        self._command.on_trigger(lambda _: send(ToggleDark()))
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
        """Shows what is chosen."""
        appearance = view.appearance
        self.dark.value = appearance.dark
        self.force_scale.value = appearance.force_scale
        self.cones.value, self.lenses.value = appearance.cones, appearance.lenses
        self.whole_hand.value, self.lecture.value = appearance.whole_hand, appearance.lecture

    def remove(self) -> None:
        """Takes everything off the page."""
        self._folder.remove()
        self._command.remove()

    # In the viewer server's event loop, where the order in which a user does things is kept.
    async def _pass_on(self, event: viser.GuiEvent[Any]) -> None:
        """Asks for what the widgets say; values that the program sets must not come back."""
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
