"""The controls of the selected part of the scenario, and of parameters found by a search."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

import viser

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import custom_law, law_names
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.disturbances import is_of_disturbance
from slipgrasp.web.model.draft import Draft, error_words
from slipgrasp.web.model.editing import Editing, LawNote
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.scenario import Undo
from slipgrasp.web.model.intents.selection import FindParameters, Select, ToggleAllParameters
from slipgrasp.web.model.parameter_groups import (
    Entry,
    Group,
    disturbance_groups,
    disturbance_title,
    group_parameters,
    law_groups,
)
from slipgrasp.web.model.selection import Selection, matches, parts_of
from slipgrasp.web.model.view import RunStage, ViewState
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.page.markup import click_attribute
from slipgrasp.web.panels.parameter_inputs import Control, add_control

_BELOW = 0.5
_LONGEST_SEARCH = 80
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=[a-zA-Z])")


class _ShownGroup(NamedTuple):
    """A folder with the controls of a group.

    Attributes:
        group: The group.
        folder: The folder.
        controls: Its controls, with their groups.
    """

    group: Group
    folder: viser.GuiFolderHandle
    controls: list[tuple[Control, Entry]]


class ControlsPanel:
    """Selection of a part, and its controls, which show the values at the play head.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._parts = gui.add_html("")
        self._search_box = gui.add_text(
            "find a control",
            "",
            hint="Shows all parameters with these words in their name, key or unit.",
        )
        self._search_box.on_update(self._search)
        self._groups: list[_ShownGroup] = []
        self._disturbance_groups: list[_ShownGroup] = []
        self._disturbances: tuple[str, ...] = ()
        self._controls: dict[str, list[tuple[Control, viser.GuiFolderHandle]]] = {}
        self._errors: list[viser.GuiHtmlHandle] = []
        self._told: tuple[FieldError, ...] = ()
        self._law_line: viser.GuiHtmlHandle | None = None
        self._law_note: LawNote | None = None
        self._shown: tuple[Draft, int] | None = None
        self._selected: object = None
        self._kind_keys: set[str] = set()
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
        self._select(view)
        if view.status.errors is not self._told:
            self._tell(view.status.errors, draft, view.editing)
        if view.editing.law_note != self._law_note:
            self._tell_law(view.editing.law_note)

    async def _search(self, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            self._send(FindParameters(self._search_box.value[:_LONGEST_SEARCH]))

    def _select(self, view: ViewState) -> None:
        """Shows the folders of the selection, and the controls that are found."""
        selection, parts = view.selection, tuple(parts_of(view.draft))
        moment = view.moment
        kinds = {key: str(view.draft.value_at(moment, key)) for key in self._kind_keys}
        selected = (selection, parts, kinds)
        if selected == self._selected:
            return
        self._selected = selected
        if not selection.search:
            self._search_box.value = ""
        self._parts.content = parts_html(selection, parts)
        for group, folder, controls in (*self._groups, *self._disturbance_groups):
            found = [_is_found(selection.search, group, entry) for _, entry in controls]
            for (control, entry), is_found in zip(controls, found, strict=True):
                control.use(is_found and _uses(entry, kinds))
            is_chosen = selection.all or group.part == selection.part
            fits = group.title == kinds[LAW] or group.title not in law_names()
            folder.visible = fits and (any(found) if selection.search else is_chosen)

    def control(self, key: str, index: int = 0) -> Control:
        """The control of a parameter; some have a second one, a field for a list."""
        return self._controls[key][index][0]

    @property
    def shown_keys(self) -> set[str]:
        """Parameters whose controls are visible."""
        return {
            control.key
            for each in (*self._groups, *self._disturbance_groups)
            for control, _ in each.controls
            if each.folder.visible and control.input.visible
        }

    def law_folder(self, kind: str) -> viser.GuiFolderHandle:
        """Parent of the controls of a custom law."""
        return next(each.folder for each in self._groups if each.group.title == kind)

    @property
    def law_line(self) -> str:
        """HTML below the control of the law; may be empty."""
        return self._law_line.content if self._law_line is not None else ""

    @property
    def errors(self) -> tuple[str, ...]:
        """HTML below wrong fields."""
        return tuple(line.content for line in self._errors)

    def _clear(self) -> None:
        self._tell_law(None)
        for line in self._errors:
            line.remove()
        for each in (*self._groups, *self._disturbance_groups):
            each.folder.remove()
        self._errors, self._groups, self._controls = [], [], {}
        self._disturbance_groups, self._disturbances = [], ()

    def _build(self, scenario: Scenario) -> None:
        self._clear()
        self._base, self._shown, self._told, self._selected = scenario, None, (), None
        definitions = parameter_definitions(scenario)
        laws = law_groups(scenario)
        of_laws = {entry.parameter.key for group in laws for entry in group.entries}
        steady = {key: each for key, each in _steady(definitions).items() if key not in of_laws}
        groups = group_parameters(steady, scenario.finger_names)
        main, details = (
            [g for g in groups if bool(g.part) is is_main] for is_main in (True, False)
        )
        self._groups = [
            *self._add_groups([*main, *laws], definitions, self._parts.order + _BELOW),
            *self._add_groups(details, definitions, self._search_box.order),
        ]
        entries = (entry for each in self._groups for _, entry in each.controls)
        self._kind_keys = {LAW, *(e.kind_key for e in entries if e.parameter.used_by)}

    def _build_disturbances(self, draft: Draft) -> None:
        """A folder for each push and patch; rebuilt when their number changes."""
        places = tuple(disturbance.place for disturbance in draft.disturbances)
        if places != self._disturbances:
            self._forget_errors()
            self._disturbances, self._shown = places, None
            for each in self._disturbance_groups:
                each.folder.remove()
            self._controls = {
                key: k for key, k in self._controls.items() if not is_of_disturbance(key)
            }
            names = draft.base.finger_names
            groups = disturbance_groups(draft.disturbances, names, draft.base.space)
            self._disturbance_groups = self._add_groups(groups, {}, self._parts.order)
            self._selected = None
        folders = (each.folder for each in self._disturbance_groups)
        for folder, disturbance in zip(folders, draft.disturbances, strict=True):
            if folder.label != (title := disturbance_title(disturbance)):
                folder.label = title

    def _add_groups(
        self, groups: Sequence[Group], definitions: dict[str, Parameter], after: float
    ) -> list[_ShownGroup]:
        """Folders that follow an element before the next one."""
        share = _BELOW / (len(groups) + 1)
        return [
            self._add_group(group, definitions, after + (i + 1) * share)
            for i, group in enumerate(groups)
        ]

    def _add_group(
        self, group: Group, definitions: dict[str, Parameter], order: float
    ) -> _ShownGroup:
        folder = self._gui.add_folder(group.title, order=order, visible=False)
        controls: list[tuple[Control, Entry]] = []
        with folder:
            for entry in group.entries:
                control = add_control(self._gui, entry, definitions, self._send)
                self._controls.setdefault(control.key, []).append((control, folder))
                controls.append((control, entry))
        return _ShownGroup(group, folder, controls)

    def _show_values(self, draft: Draft, view: ViewState) -> None:
        """Updates the controls if something changed.

        The control that the user is moving is not changed.
        """
        moment = view.moment
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


def _is_found(search: str, group: Group, entry: Entry) -> bool:
    return not search or matches(search, group.title, entry.label, entry.parameter.key)


def _uses(entry: Entry, kinds: Mapping[str, str]) -> bool:
    """Whether any part uses a parameter, by the kinds of all parts."""
    if not entry.parameter.used_by:
        return True
    kind = kinds[entry.kind_key]
    return kind in entry.parameter.used_by or _is_seen_by_custom_law(kind, entry.parameter.key)


def parts_html(selection: Selection, parts: Iterable[tuple[str, str]]) -> str:
    """A row of buttons that select a part of the scenario."""
    chips = [
        _chip(name, Select(part), part == selection.part and not selection.all)
        for part, name in parts
    ]
    every = _chip("all", ToggleAllParameters(), selection.all)
    hint = "Shows the controls of a part, like a click on it in the view"
    return (
        f"<div class='sg-parts' role='group' aria-label='Part of the scenario' title='{hint}'>"
        f"{''.join(chips)}{every}</div>"
    )


def _chip(name: str, intent: Intent, is_pressed: bool) -> str:
    return (
        f"<button type='button' class='sg-chip' aria-pressed='{str(is_pressed).lower()}' "
        f"{click_attribute(intent)}>{escape(name)}</button>"
    )


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
