"""The scenario panel: presets, reach of controls, changes during the run, and undo."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

import viser

from slipgrasp.core.run.verdict import describe_run, scenario_title
from slipgrasp.core.scenario import RAIL
from slipgrasp.core.scenario.custom_laws import law_names
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.laws import law_alias, law_label
from slipgrasp.core.scenario.loading import all_preset_names
from slipgrasp.web.charts.law_charts import law_run_words
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.disturbances import DisturbanceKind, disturbance_words, is_offered
from slipgrasp.web.model.draft import Draft, TimedEdit, change_time
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    ChoosePreset,
    ChooseReach,
    Redo,
    RemoveChange,
    RemoveChanges,
    RemoveDisturbance,
    ResetScenario,
    Undo,
)
from slipgrasp.web.model.laws import law_change_words, main_changes
from slipgrasp.web.model.laws_view import LawRun
from slipgrasp.web.model.parameter_groups import value_words
from slipgrasp.web.model.playback import Playback
from slipgrasp.web.model.view import Ghost, ViewState
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.page.markup import click_attribute
from slipgrasp.web.panels.parameter_inputs import as_text

_UNDO, _REDO, _RESET = "↶ undo", "↷ redo", "reset"
_STEPS: dict[str, Intent] = {_UNDO: Undo(), _REDO: Redo(), _RESET: ResetScenario()}
_DISTURBANCES = {kind.value: kind for kind in DisturbanceKind}
_ACTING = "Act at the play head. Push: a short force on the object, initially 5 N downwards"
_POURING = "Pour: mass and inertia grow by half. Each can be edited below, and undone."
_DISTURBING = (
    f"{_ACTING}. Wet patch: less friction from then on below the selected finger, or else below "
    f"the one nearest to slipping. {_POURING}"
)
_DISTURBING_SLIDES = f"{_ACTING} in the view from above. {_POURING}"
_REACHES: dict[str, Reach] = {reach.value: reach for reach in Reach}


class ScenarioPanel:
    """Presets, undo, and the changes during the run.

    Args:
        gui: Parent of the widgets.
        draft: The first draft.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, draft: Draft, send: Send) -> None:
        self._send = send
        self.origin = gui.add_dropdown(
            "scenario",
            _origins(draft.origin),
            initial_value=draft.origin,
            hint=_what_it_shows(draft),
        )
        # Without a hint, which would cover the laws below; the keys are in the list of keys.
        self.steps = gui.add_button_group("changes", tuple(_STEPS))
        self.laws = gui.add_html("")
        self.reach = gui.add_dropdown(
            "controls act",
            tuple(_REACHES),
            initial_value=Reach.PLAY_HEAD.value,
            hint="At the play head: while the run is paused, a control changes its value from "
            "there on, and earlier samples do not change; while it plays, the value holds from "
            "the start. On the whole run: it always holds from the start.",
        )
        self.note = gui.add_html("")
        self.disturbances = gui.add_button_group(
            "disturb",
            tuple(_DISTURBANCES),
            hint=_DISTURBING,
        )
        self.changes = gui.add_html("")
        self._connect()
        self._noted: tuple[object, ...] | None = None
        self._listed: tuple[object, ...] | None = None
        self._shown: Draft | None = None
        self._laws: object = None
        self._finger: int | None = None

    def update(self, view: ViewState) -> None:
        """Shows the draft, and the reach of controls."""
        draft = view.draft
        if draft is not self._shown:
            self._show_origin(view)
            self._offer_disturbances(draft)
            self._shown = draft
        self._finger = view.selection.finger
        self._show_laws(view)
        self.reach.value = view.editing.reach.value
        noted = (view.editing.reach, _resting_time(view.playback))
        if noted != self._noted:
            self._noted = noted
            self.note.content = reach_html(view.editing.reach, view.playback)
        listed = (draft, view.ghost)
        if listed != self._listed:
            self._listed = listed
            self.changes.content = listed_html(draft, view.ghost)

    def _connect(self) -> None:
        # In the viewer server's event loop, which keeps the order of events. Values that
        # the program sets have no client, and are ignored.
        async def pass_on(event: viser.GuiEvent[Any]) -> None:
            intent = self._intent(event)
            if event.client_id is not None and intent is not None:
                self._send(intent)

        self.origin.on_update(pass_on)
        self.reach.on_update(pass_on)
        self.steps.on_click(pass_on)
        self.disturbances.on_click(pass_on)

    def _intent(self, event: viser.GuiEvent[Any]) -> Intent | None:
        """The intent of a widget; its value comes from a browser."""
        if event.target is self.origin:
            return ChoosePreset(self.origin.value)
        if event.target is self.steps:
            return _STEPS.get(self.steps.value)
        if event.target is self.disturbances:
            kind = _DISTURBANCES.get(self.disturbances.value)
            return AddDisturbance(kind, self._finger) if kind else None
        reach = _REACHES.get(self.reach.value)
        return ChooseReach(reach) if reach else None

    def _show_laws(self, view: ViewState) -> None:
        if not view.draft.base.space.has_hand:
            self._laws, self.laws.content = None, ""
            return
        moment = view.moment
        law = str(view.draft.value_at(moment, LAW))
        runs = view.laws.runs if view.laws.draft is view.draft else ()
        if (law, runs) != self._laws:
            self._laws = (law, runs)
            self.laws.content = law_buttons_html(law, runs)

    def _offer_disturbances(self, draft: Draft) -> None:
        """Offers low-friction patches only to hands, and pushes except on a rail."""
        space = draft.base.space
        has_hand = space.has_hand
        offered = tuple(each.value for each in DisturbanceKind if is_offered(each, space))
        if self.disturbances.options != offered:
            self.disturbances.options = offered
            slides = _POURING if space is RAIL else _DISTURBING_SLIDES
            self.disturbances.hint = _DISTURBING if has_hand else slides

    def _show_origin(self, view: ViewState) -> None:
        """Shows the origin of the controls."""
        opened = view.replay.label if view.replay else None
        file = view.from_file.origin if view.from_file else None
        self.origin.options = _origins(view.draft.origin, opened, file)
        self.origin.value = view.draft.origin
        self.origin.hint = _what_it_shows(view.draft)


def _what_it_shows(draft: Draft) -> str:
    return scenario_title(draft.base) or "The scenario from which the controls start."


def _origins(*opened: str | None) -> tuple[str, ...]:
    """The scenarios to choose from: opened files, and the presets."""
    presets = all_preset_names()
    return (*(name for name in dict.fromkeys(opened) if name and name not in presets), *presets)


def _resting_time(playback: Playback | None) -> float | None:
    """The time of the play head, None while it moves [s]."""
    return None if playback is None or playback.playing else change_time(playback.time)


def law_buttons_html(law: str, runs: Sequence[LawRun]) -> str:
    """A row of buttons for the control laws, with the outcomes of their runs if known.

    Args:
        law: The law at the play head.
        runs: The runs with every law; none unless the tab *Laws* has simulated them.
    """
    known = {run.kind: run for run in runs}
    buttons = "".join(
        _law_button(name, known.get(name), name == law)
        for name in dict.fromkeys((*law_names(), law))
    )
    return f"<div class='sg-parts' role='group' aria-label='Control law'>{buttons}</div>"


def _law_button(name: str, run: LawRun | None, is_present: bool) -> str:
    hint, dot = f"Applies {law_label(name)} to the whole run; can be undone", ""
    if run is not None:
        hint = f"{law_run_words(run)}. {hint}"
        colour = tone("bad" if run.result is None else describe_run(run.result).tone)
        dot = f" <i style='color:{colour}'>●</i>"
    return (
        f"<button type='button' class='sg-chip' aria-pressed='{str(is_present).lower()}' "
        f"title='{escape(hint)}' {click_attribute(ChooseLaw(name))}>"
        f"{escape(law_alias(name))}{dot}</button>"
    )


def reach_html(reach: Reach, playback: Playback | None) -> str:
    """A sentence about the reach of a control that is moved now."""
    time = _resting_time(playback)
    if reach is Reach.WHOLE_RUN:
        words = "A control acts <b>on the whole run</b>."
    elif time is not None and time <= 0.0:
        words = "At t = 0 a control acts <b>on the whole run</b>."
    elif time is None:
        words = "While it plays: <b>on the whole run</b>."
    else:
        words = f"A control acts <b>from {time:.5g} s on</b>."
    return f"<div class='sg-editor-note sg-reach'>{words}</div>"


def listed_html(draft: Draft, ghost: Ghost | None) -> str:
    """Changes, events and the ghost below one line that counts them."""
    rows = _change_rows(draft)
    count = {0: "No changes", 1: "1 change"}.get(len(rows), f"{len(rows)} changes")
    listed = changes_html(draft) + ghost_html(ghost)
    empty = "<div class='sg-editor-note'>Drag the object in the picture to push it.</div>"
    return (
        "<details class='sg-listed' data-sg-fold='changes'>"
        f"<summary>{count} during the run{' · a ghost' if ghost else ''}</summary>"
        "<div role='region' tabindex='0' aria-label='Changes and ghost'>"
        f"{listed or empty}</div></details>"
    )


def changes_html(draft: Draft) -> str:
    """Changes and disturbances, each with a button that removes it; may be empty.

    A law and the settings that came with it are one entry.
    """
    rows = _change_rows(draft)
    if len(rows) > 1:
        clear = _button("remove all", "Remove all of these changes", RemoveChanges())
        rows.append(f"<div class='sg-editor-row'><span></span>{clear}</div>")
    return f"<div class='sg-editor-note'>{''.join(rows)}</div>" if rows else ""


def _change_rows(draft: Draft) -> list[str]:
    return [
        *(_change_html(draft, change) for change in main_changes(draft)),
        *(_disturbance_html(draft, index) for index in range(len(draft.disturbances))),
    ]


def _change_html(draft: Draft, change: TimedEdit) -> str:
    words = escape(
        law_change_words(draft, change)
        if change.key == LAW
        else value_words(draft.base, change.key, as_text(change.value))
    )
    button = _button("✕", "Remove this change", RemoveChange(change.time, change.key))
    return f"<div class='sg-editor-row'><span><b>{change.time:g} s</b> {words}</span>{button}</div>"


def _disturbance_html(draft: Draft, index: int) -> str:
    disturbance = draft.disturbances[index]
    words = escape(disturbance_words(disturbance))
    button = _button("✕", "Remove this", RemoveDisturbance(index))
    when = f"<b>{disturbance.time:g} s</b>"
    return f"<div class='sg-editor-row'><span>{when} {words}</span>{button}</div>"


def ghost_html(ghost: Ghost | None) -> str:
    """The label of the ghost, and a button that dismisses it; empty without a ghost."""
    if ghost is None:
        return ""
    hint = f"Dismiss the ghost (key {keys_of(EndComparison())})"
    button = _button("dismiss ghost", hint, EndComparison())
    return (
        "<div class='sg-editor-note'><div class='sg-editor-row'>"
        f"<span>Ghost: {escape(ghost.label)}</span>{button}</div></div>"
    )


def _button(label: str, hint: str, intent: Intent) -> str:
    """A small button that sends an intent."""
    named = f" aria-label='{hint}'" if label == "✕" else ""
    return f"<button type='button' title='{hint}'{named} {click_attribute(intent)}>{label}</button>"
