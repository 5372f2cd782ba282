"""Controls of all parameters in groups, with error messages below them."""

from __future__ import annotations

import re
import time
from html import escape

import viser

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import custom_law
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.disturbances import is_of_disturbance
from slipgrasp.web.model.draft import Draft, change_time, error_words
from slipgrasp.web.model.editing import Editing, LawNote
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.scenario import Undo
from slipgrasp.web.model.parameter_groups import (
    CONTROLLER,
    Entry,
    Group,
    disturbance_groups,
    disturbance_title,
    group_parameters,
    law_groups,
)
from slipgrasp.web.model.view import RunStage, ViewState
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.panels.parameter_inputs import Control, add_control

_BELOW = 0.5
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=[a-zA-Z])")


class ControlsPanel:
    """Panel with controls; each shows the value at the play head.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._folders: list[viser.GuiFolderHandle] = []
        self._disturbance_folders: list[viser.GuiFolderHandle] = []
        self._disturbances: tuple[str, ...] = ()
        self._law_folders: dict[str, viser.GuiFolderHandle] = {}
        self._conditional: list[tuple[Control, Entry]] = []
        self._controls: dict[str, list[tuple[Control, viser.GuiFolderHandle]]] = {}
        self._errors: list[viser.GuiHtmlHandle] = []
        self._told: tuple[FieldError, ...] = ()
        self._law_line: viser.GuiHtmlHandle | None = None
        self._law_note: LawNote | None = None
        self._shown: tuple[Draft, int] | None = None
        self._in_hand = ""
        self._base: Scenario | None = None

    def update(self, view: ViewState) -> None:
        """Shows the values at the play head, and errors.

        There are no controls while the first recording is opened, which has other parameters: slow
        pages would receive updates of removed widgets.
        """
        if view.status.stage is RunStage.OPENING:
            return
        draft = view.draft
        if draft.base is not self._base:
            self._build(draft.base)
        self._build_disturbances(draft)
        self._show_values(draft, view)
        if view.status.errors is not self._told:
            self._tell(view.status.errors, draft, view.editing)
        if view.editing.law_note != self._law_note:
            self._tell_law(view.editing.law_note)

    def control(self, key: str, index: int = 0) -> Control:
        """The control of a parameter; some have a second one, a field for a list."""
        return self._controls[key][index][0]

    def law_folder(self, kind: str) -> viser.GuiFolderHandle:
        """Parent of the controls of a custom law."""
        return self._law_folders[kind]

    @property
    def law_line(self) -> str:
        """HTML below the control of the law; may be empty."""
        return self._law_line.content if self._law_line is not None else ""

    @property
    def errors(self) -> tuple[str, ...]:
        """HTML below wrong fields."""
        return tuple(line.content for line in self._errors)

    def remove(self) -> None:
        """Removes all widgets."""
        self._tell_law(None)
        laws = self._law_folders.values()
        for element in (*self._errors, *self._disturbance_folders, *laws, *self._folders):
            element.remove()
        self._law_folders = {}
        self._errors, self._folders, self._controls = [], [], {}
        self._disturbance_folders, self._disturbances, self._conditional = [], (), []

    def _build(self, scenario: Scenario) -> None:
        self.remove()
        self._base, self._shown, self._told = scenario, None, ()
        definitions = parameter_definitions(scenario)
        laws = law_groups(scenario)
        of_laws = {entry.parameter.key for group in laws for entry in group.entries}
        steady = {key: each for key, each in _steady(definitions).items() if key not in of_laws}
        for group in group_parameters(steady, scenario.finger_names):
            self._folders.append(self._add_group(group, definitions))
            if group.title == CONTROLLER:
                self._law_folders = {law.title: self._add_group(law, {}) for law in laws}

    def _build_disturbances(self, draft: Draft) -> None:
        """A folder for each disturbance, above all others; rebuilt when their number changes."""
        places = tuple(disturbance.place for disturbance in draft.disturbances)
        if places != self._disturbances:
            self._forget_errors()
            self._disturbances, self._shown = places, None
            for folder in self._disturbance_folders:
                folder.remove()
            self._controls = {
                key: k for key, k in self._controls.items() if not is_of_disturbance(key)
            }
            names, top = draft.base.finger_names, self._folders[0].order - 1.0
            groups = disturbance_groups(draft.disturbances, names, draft.base.space)
            self._disturbance_folders = [
                self._add_group(group, {}, top + (i + 1.0) / (len(groups) + 1.0))
                for i, group in enumerate(groups)
            ]
        for folder, disturbance in zip(self._disturbance_folders, draft.disturbances, strict=True):
            if folder.label != (title := disturbance_title(disturbance)):
                folder.label = title

    def _add_group(
        self, group: Group, definitions: dict[str, Parameter], order: float | None = None
    ) -> viser.GuiFolderHandle:
        folder = self._gui.add_folder(group.title, order=order, expand_by_default=group.is_open)
        with folder:
            for entry in group.entries:
                self._add(entry, definitions, folder)
        return folder

    def _add(
        self, entry: Entry, definitions: dict[str, Parameter], folder: viser.GuiFolderHandle
    ) -> None:
        control = add_control(self._gui, entry, definitions, self._send)
        self._controls.setdefault(control.key, []).append((control, folder))
        if entry.parameter.used_by:
            self._conditional.append((control, entry))

    def _show_values(self, draft: Draft, view: ViewState) -> None:
        """Updates the controls if something changed.

        The control that the user is moving is not changed.
        """
        moment = change_time(view.playback.time) if view.playback else 0.0
        in_hand = view.editing.key_in_hand(time.monotonic())
        wanted = (draft, draft.num_changes_until(moment))
        if wanted == self._shown and in_hand == self._in_hand:
            return
        keys = set(self._controls)
        if self._shown is not None:
            keys &= self._shown[0].touched | draft.touched
        self._shown, self._in_hand = wanted, in_hand
        for key in keys - {in_hand}:
            for control, _ in self._controls[key]:
                control.show(draft.value_at(moment, key))
        for kind, folder in self._law_folders.items():
            folder.visible = kind == draft.value_at(moment, LAW)
        for control, entry in self._conditional:
            kind = str(draft.value_at(moment, entry.kind_key))
            control.use(
                kind in entry.parameter.used_by or _is_seen_by_custom_law(kind, control.key)
            )

    def _tell(self, errors: tuple[FieldError, ...], draft: Draft, editing: Editing) -> None:
        """Shows errors below their fields."""
        self._forget_errors()
        self._told = errors
        last = editing.gesture.key if editing.gesture else ""
        for error in errors:
            for control, folder in self._find(draft.key_of(error)) or self._controls.get(last, []):
                with folder:
                    content, order = error_html(error_words(error)), control.input.order + _BELOW
                    self._errors.append(self._gui.add_html(content, order=order))

    def _tell_law(self, note: LawNote | None) -> None:
        """Shows the settings of a law below its control."""
        self._law_note = note
        if self._law_line is not None:
            self._law_line.remove()
            self._law_line = None
        if note is not None:
            ((control, folder),) = self._controls[LAW]
            with folder:
                order = control.input.order + _BELOW
                self._law_line = self._gui.add_html(law_note_html(note), order=order)

    def _forget_errors(self) -> None:
        for line in self._errors:
            line.remove()
        self._errors, self._told = [], ()

    def _find(self, key: str) -> list[tuple[Control, viser.GuiFolderHandle]] | None:
        """The controls of a parameter, or of the closest key that has one."""
        for known, controls in self._controls.items():
            if known == key or known.startswith(f"{key}.") or key.startswith(f"{known}."):
                return controls
        return None


def _steady(definitions: dict[str, Parameter]) -> dict[str, Parameter]:
    """The parameters of the scenario without changes and disturbances."""
    return {
        key: parameter
        for key, parameter in definitions.items()
        if not (key.startswith("changes.") or is_of_disturbance(key))
    }


def _is_seen_by_custom_law(kind: str, key: str) -> bool:
    """Whether a custom law receives a parameter that only some built-in laws use."""
    law = custom_law(kind)
    return law is not None and key == law.facts.holds_with


def error_html(message: str) -> str:
    """An error message below its field."""
    return f"<div role='alert' class='sg-wrong' style='color:{tone('bad')}'>{escape(message)}</div>"


def law_note_html(note: LawNote) -> str:
    """The settings of a law, and how to undo them, below its control."""
    reach = f"from t = {note.time:g} s on" if note.time > 0.0 else "on the whole run"
    settings = escape(_BEFORE_UNIT.sub("\u00a0", note.settings or "no other setting changed"))
    return (
        f"<div role='status' class='sg-editor-note'><b>{escape(note.kind)}</b> {reach}: "
        f"{settings}; undo with {escape(keys_of(Undo()))}.</div>"
    )
