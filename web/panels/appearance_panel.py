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
_OPTIONS = (
    ("dark", "dark", "Dark page and dark scene, for dim light."),
    ("force_scale", "force scale", "Scale of the arrows of the contact forces."),
    (
        "cones",
        "friction cones",
        "Draw the friction cone, which contains the force while a fingertip sticks, "
        "and dashed its estimate.",
    ),
    ("lenses", "close-ups", "Show every contact magnified above the hand."),
    (
        "whole_hand",
        "whole hand",
        "Include the fingers with their mounts in the view, not only the object.",
    ),
    (
        "lecture",
        "lecture",
        "Show only the view, the timeline, the outcome and one chart, in large type "
        f"(key {keys_of(ToggleLecture())}). The other keys still work.",
    ),
)
"""Field of `Appearance`, label and hint of each option."""


class AppearancePanel:
    """Panel of display options.

    Args:
        gui: Parent of the widgets.
        appearance: Initial options.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, appearance: Appearance, send: Send) -> None:
        self._send = send
        self.inputs: dict[str, Any] = {}
        with gui.add_folder("Picture", expand_by_default=False):
            for field, label, hint in _OPTIONS:
                self.inputs[field] = _add_input(gui, label, getattr(appearance, field), hint)
        command = gui.add_command("Light or dark page", icon=viser.Icon.MOON)
        command.on_trigger(lambda _: send(ToggleDark()))
        for widget in self.inputs.values():
            widget.on_update(self._pass_on)

    def update(self, view: ViewState) -> None:
        """Shows the current options."""
        for field, widget in self.inputs.items():
            widget.value = getattr(view.appearance, field)

    # In the viewer server's event loop, which preserves the order of events.
    async def _pass_on(self, event: viser.GuiEvent[Any]) -> None:
        """Sends changes by the user; changes by the program are ignored."""
        if event.client_id is not None:
            chosen = {field: widget.value for field, widget in self.inputs.items()}
            force_scale = float(chosen.pop("force_scale"))
            switches = {field: bool(value) for field, value in chosen.items()}
            self._send(SetAppearance(Appearance(force_scale=force_scale, **switches)))


def _add_input(gui: viser.GuiApi, label: str, value: bool | float, hint: str) -> Any:
    if isinstance(value, bool):
        return gui.add_checkbox(label, value, hint=hint)
    return gui.add_slider(
        label, LEAST_FORCE_SCALE, LARGEST_FORCE_SCALE, _FORCE_STEP, value, hint=hint
    )
