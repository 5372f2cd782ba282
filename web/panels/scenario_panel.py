"""The scenario: a preset, and a knob for everything that may change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import viser

from core.exceptions import ScenarioError
from core.loading import parameter_definitions, preset_names
from core.parameters import Parameter
from core.scenario import Scenario
from web.intents.intent import Send
from web.intents.scenario import ChoosePreset, ResetScenario
from web.panels.parameter_inputs import Knob, add_knob, as_text, is_offered
from web.replay import Replay
from web.view import Draft, ViewState
from web.words import key_words, unit_words

__all__ = ["ScenarioPanel", "group_knobs", "knob_label"]

_GROUPS = ("object", "fingers", "estimates", "controller")
_ESTIMATES_TITLE = "What the controller believes at first"


class ScenarioPanel:
    """Lets the user choose a preset and move knobs.

    Args:
        gui: Where it goes.
        draft: What the knobs start from.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, draft: Draft, send: Send) -> None:
        self._gui, self._send = gui, send
        self._origin = gui.add_dropdown(
            "scenario", preset_names(), initial_value=draft.origin, hint=draft.base.title
        )
        self._origin.on_update(self._choose)
        self._reset = gui.add_button(
            "Back to the preset", icon=viser.Icon.RESTORE, hint="Undo every change of the knobs."
        )
        self._reset.on_click(lambda _: send(ResetScenario()))
        self._folders: list[viser.GuiFolderHandle] = []
        self._knobs: dict[str, Knob] = {}
        self._shown: Draft | None = None

    def update(self, view: ViewState) -> None:
        """Shows what is asked for; a knob that the user is moving already stands right."""
        draft = view.draft
        if draft is self._shown:
            return
        if self._shown is None or draft.base is not self._shown.base:
            self._build(draft.base)
            self._show_origin(draft, view.replay)
        self._show_values(draft)
        self._reset.disabled = not draft.edits
        self._shown = draft

    def knob(self, key: str) -> Knob:
        """The knob of a parameter."""
        return self._knobs[key]

    def remove(self) -> None:
        """Takes everything off the page."""
        for element in (*self._folders, self._origin, self._reset):
            element.remove()
        self._folders, self._knobs = [], {}

    def _show_origin(self, draft: Draft, replay: Replay | None) -> None:
        """Names what the knobs start from; a recording stays among the scenarios to choose."""
        recordings = (replay.label,) if replay is not None else ()
        self._origin.options = (*recordings, *preset_names())
        self._origin.value = draft.origin
        self._origin.hint = draft.base.title
        what = "recording" if draft.origin in recordings else "preset"
        self._reset.label = f"Back to the {what}"

    def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is not None:
            self._send(ChoosePreset(event.target.value))

    def _build(self, scenario: Scenario) -> None:
        for folder in self._folders:
            folder.remove()
        self._folders, self._knobs = [], {}
        definitions = parameter_definitions(scenario)
        names = scenario.finger_names
        for title, parameters in group_knobs(definitions, names).items():
            folder = self._gui.add_folder(title)
            self._folders.append(folder)
            with folder:
                for parameter in parameters:
                    label = knob_label(parameter, definitions, names)
                    knob = add_knob(self._gui, label, parameter, definitions, self._send)
                    self._knobs[parameter.key] = knob

    def _show_values(self, draft: Draft) -> None:
        """Sets every knob; values that are not allowed stay as the user left them."""
        try:
            definitions = parameter_definitions(draft.scenario())
        except ScenarioError:
            return
        for key, knob in self._knobs.items():
            value = definitions[key].value
            if isinstance(knob, viser.GuiTextHandle):
                knob.value = as_text(value)
            elif knob.value != value:
                knob.value = value  # type: ignore[assignment]


def group_knobs(
    definitions: Mapping[str, Parameter], names: Sequence[str]
) -> dict[str, list[Parameter]]:
    """The parameters that have a knob, under the titles of their folders."""
    offered = filter(is_offered, definitions.values())
    groups: dict[str, list[Parameter]] = {}
    for parameter in sorted(offered, key=lambda p: _GROUPS.index(p.key.partition(".")[0])):
        groups.setdefault(_group_title(parameter.key, names), []).append(parameter)
    return groups


def _group_title(key: str, names: Sequence[str]) -> str:
    head, _, rest = key.partition(".")
    if head == "fingers":
        return f"{names[int(rest.partition('.')[0])].capitalize()} finger"
    return _ESTIMATES_TITLE if head == "estimates" else head.capitalize()


def knob_label(
    parameter: Parameter, definitions: Mapping[str, Parameter], names: Sequence[str]
) -> str:
    """What a knob is called inside its folder, with its unit."""
    parts = parameter.key.split(".")
    if parts[0] == "estimates":
        target = definitions[str(definitions[f"{parts[0]}.{parts[1]}.parameter"].value)]
        which = "" if parts[2] == "initial" else f", {parts[2]}"
        return key_words(target.key, names) + which + unit_words(target.unit)
    inside = parts[2:] if parts[0] == "fingers" else parts[1:]
    return key_words(".".join(inside), names) + unit_words(parameter.unit)
