"""The reducer of the scenario: the draft, and its history."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import RAIL
from slipgrasp.core.scenario.custom_laws import law_names
from slipgrasp.core.scenario.field_errors import shortened
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import scenario_from_toml
from slipgrasp.web.model.disturbances import (
    Disturbance,
    DisturbanceKind,
    is_offered,
    low_friction_patch,
    push_at,
)
from slipgrasp.web.model.draft import Draft, Value, change_time
from slipgrasp.web.model.editing import LawNote, Reach, Turn
from slipgrasp.web.model.hints import followed
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    ChoosePreset,
    ChooseReach,
    DragObject,
    LetGo,
    LoadScenario,
    Redo,
    RemoveChange,
    RemoveChanges,
    RemoveDisturbance,
    ResetScenario,
    SetParameter,
    TryOut,
    Undo,
)
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop
from slipgrasp.web.model.laws import set_words, with_law, without_law_change
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.model.playback import whole_window
from slipgrasp.web.model.sampling import locate
from slipgrasp.web.model.tour import TOUR
from slipgrasp.web.model.view import Drag, RunStatus, Shown, ViewState
from slipgrasp.web.reducers.reducer import Reducer

_POURED = 1.5
"""Factor of mass and inertia of a pour."""
_DIGITS = 6


class ScenarioReducer(Reducer):
    """Edits the draft; the reducer of runs notices a new draft and simulates it."""

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Applies an intent to the draft."""
        if isinstance(intent, ChoosePreset | ResetScenario) and view.editing.file_errors:
            view = replace(view, editing=replace(view.editing, file_errors=()))
        match intent:
            # On a rail, the law is a parameter like any other.
            case SetParameter(key, value) if key == LAW and view.draft.base.space is not RAIL:
                return _with_law(view, value)
            case ChooseLaw(law):
                return _with_law(view, law, on_all=True)
            case TryOut(words):
                return _tried(view, words)
            case SetParameter():
                return _moved(view, intent, time.monotonic())
            case ChooseReach(reach):
                return replace(view, editing=replace(view.editing, reach=reach, gesture=None))
            case Undo():
                return _turned(view, view.editing.history.undo(view.draft))
            case Redo():
                return _turned(view, view.editing.history.redo(view.draft))
            case ChoosePreset(name):
                return _chosen(view, name)
            case LoadScenario(name, content):
                return _loaded(view, name, content)
            case EndComparison():
                return replace(view, editing=replace(view.editing, ghost_due=False))
            case ToggleTour():
                return _visited(view, 0) if view.stop is None else replace(view, tour=None)
            case VisitStop(place):
                return _visited(view, place)
            case AddDisturbance():
                return _with_draft(view, _disturbed(view, intent))
            case DragObject(force):
                return _dragged(view, force)
            case LetGo(force):
                return _let_go(view, force)
            case RemoveChange() | RemoveChanges() | RemoveDisturbance() | ResetScenario():
                return _with_draft(view, _simplified(view.draft, intent))
            case _:
                return view


def _simplified(
    draft: Draft, intent: RemoveChange | RemoveChanges | RemoveDisturbance | ResetScenario
) -> Draft:
    """The draft after a removal."""
    match intent:
        case RemoveChange(moment, key) if key == LAW:
            return without_law_change(draft, moment)
        case RemoveChange(moment, key):
            return draft.without_change(moment, key)
        case RemoveDisturbance(index):
            return draft.without_disturbance(index)
        case RemoveChanges():
            return draft.without_changes()
        case ResetScenario():
            return draft.reset()


def _disturbed(view: ViewState, intent: AddDisturbance) -> Draft:
    """The draft with a disturbance at the play head."""
    offered = is_offered(intent.what, view.draft.base.space)
    if view.shown is None or view.playback is None or not offered:
        return view.draft
    draft, moment = view.draft, change_time(view.playback.time)
    match intent.what:
        case DisturbanceKind.PUSH:
            return draft.with_disturbance(push_at(moment, draft.base.space))
        case DisturbanceKind.LOW_FRICTION_PATCH:
            return _wetted(draft, view.shown, moment, intent.contact)
        case DisturbanceKind.POUR:
            for key in ("object.mass", *draft.base.space.inertias):
                draft = _multiplied(draft, moment, key, _POURED)
            return draft


def _dragged(view: ViewState, force: tuple[float, ...]) -> ViewState:
    """The view while the object is dragged; unchanged if there is nothing to push.

    The play head rests at the end of the push, so that its effect is visible next to the ghost.
    """
    shown, playback = view.shown, view.playback
    if shown is None or playback is None:
        return view
    space = shown.result.scenario.space
    if view.draft.base.space is not space or len(force) != space.num_positions or space is RAIL:
        return view
    began = view.drag or Drag(force, playback, view.draft, view.editing)
    drag = began._replace(force=force)
    push = _push_of(drag)
    end = push.time + float(push.values["duration"])
    # In the time range of the latest run of the drag.
    playback = playback.reach(end, whole_window(shown.result))
    return replace(_pushed(view, drag, push), drag=drag, playback=playback)


def _let_go(view: ViewState, force: tuple[float, ...]) -> ViewState:
    """The view with the push of a drag, which plays from the push on."""
    drag = view.drag
    if drag is not None and len(force) != len(drag.force):
        force = (0.0,) * len(drag.force)
    dragged = _dragged(view, force)
    if dragged.drag is None:
        return dragged
    before, playback = dragged.drag.playback, dragged.playback
    if playback is not None and (before.playing or any(force)):
        playback = replace(playback, time=playback.window.clamp(before.time), playing=True)
    return replace(dragged, drag=None, playback=playback)


def _push_of(drag: Drag) -> Disturbance:
    return push_at(change_time(drag.playback.time), drag.draft.base.space, drag.force)


def _pushed(view: ViewState, drag: Drag, push: Disturbance) -> ViewState:
    """The view with the latest push of a drag; the whole drag is one step of undo."""
    if not any(drag.force):
        return replace(view, draft=drag.draft, editing=drag.editing)
    draft, editing = drag.draft.with_disturbance(push), drag.editing.begin(drag.draft)
    if view.draft is not drag.draft:
        # The ghost stays the run without the push.
        editing = replace(editing, ghost_due=view.editing.ghost_due)
    draft = view.draft if draft == view.draft else draft
    return replace(view, draft=draft, editing=editing, opening=view.opening + 1)


def _wetted(draft: Draft, shown: Shown, moment: float, contact: int | None) -> Draft:
    """The draft with a low-friction patch at a fingertip of the run on the screen."""
    if not draft.base.space.has_hand:
        return draft
    trace = shown.result.trace
    spot = locate(trace.times, moment)
    contacts = range(len(draft.base.fingers))
    if contact is None:
        contact = int(np.argmin(trace.friction_margin[spot.row]))
    same = shown.result.scenario.space is draft.base.space
    if contact not in contacts or trace.shape.num_contacts != len(contacts) or not same:
        return draft
    slip = spot.read(trace.slip).reshape(len(contacts), -1)[contact].tolist()
    return draft.with_disturbance(low_friction_patch(draft.base, contact, slip, moment))


def _multiplied(draft: Draft, moment: float, key: str, factor: float) -> Draft:
    value = draft.value_at(moment, key)
    if not isinstance(value, float):
        return draft
    return draft.edited_from(moment, key, float(f"{factor * value:.{_DIGITS}g}"))


def _moved(view: ViewState, intent: SetParameter, now: float) -> ViewState:
    """The view after a control was moved."""
    editing = view.editing.move(view.draft, intent.key, _held_time(view) or 0.0, now)
    draft = editing.apply(view.draft, intent.value)
    return replace(view, draft=draft, editing=editing, opening=view.opening + 1)


def _tried(view: ViewState, words: str) -> ViewState:
    """The view with a hint of the card applied to the whole run, as one step.

    Only hints that were tried on this draft are offered.
    """
    tried = view.hint_trials.of(view.draft)
    if view.shown is None or tried is None:
        return view
    scenario = view.shown.result.scenario
    options = {in_page_words(each.option.label, scenario): each.option for each in tried.helpful}
    if words not in options:
        return view
    chosen = _with_draft(view, followed(view.draft, options[words]))
    law = options[words].values.get(LAW)
    return chosen if law is None else _with_law_note(chosen, view.draft, str(law), 0.0)


def _with_law(view: ViewState, kind: Value, *, on_all: bool = False) -> ViewState:
    """The view with another law and its settings, and a note about these."""
    if not isinstance(kind, str) or kind not in law_names():
        return view
    if not view.draft.base.space.has_hand:
        return view
    held = None if on_all or view.editing.reach is Reach.WHOLE_RUN else _held_time(view)
    time = None if held is None else change_time(held)
    draft = with_law(view.draft, kind, time)
    chosen = _with_draft(view, draft)
    if chosen is view:
        return view
    return _with_law_note(chosen, view.draft, kind, time or 0.0)


def _held_time(view: ViewState) -> float | None:
    """Time of the play head [s]; None while the run plays, since changes then have no own time."""
    playback = view.playback
    return None if playback is None or playback.playing else playback.time


def _with_law_note(view: ViewState, before: Draft, kind: str, time: float) -> ViewState:
    """The view with a note about the settings of a law that acts from some time on [s]."""
    note = LawNote(kind, set_words(before, view.draft, time), time)
    return replace(view, editing=replace(view.editing, law_note=note))


def _with_draft(view: ViewState, draft: Draft) -> ViewState:
    """The view with another draft, as one step of undo; pending recordings become void."""
    if draft == view.draft and view.shown is not None:
        return view
    editing = view.editing.begin(view.draft)
    return replace(view, draft=draft, editing=editing, opening=view.opening + 1)


def _turned(view: ViewState, turn: Turn | None) -> ViewState:
    """The view after undo or redo; unchanged if there is no such step."""
    if turn is None:
        return view
    editing = replace(
        view.editing, history=turn.history, gesture=None, ghost_due=True, law_note=None
    )
    return replace(view, draft=turn.draft, editing=editing, opening=view.opening + 1)


def _chosen(view: ViewState, name: str) -> ViewState:
    """The view with a preset, or with the recording or file that was opened last."""
    recording, file = view.replay, view.from_file
    try:
        if recording is not None and name == recording.label:
            return _with_draft(view, Draft.from_replay(recording))
        if file is not None and name == file.origin:
            return _with_draft(view, file)
        return _with_draft(view, Draft.from_preset(name))
    except ScenarioError as error:
        return replace(view, status=RunStatus.refused(error))


def _visited(view: ViewState, place: int) -> ViewState:
    """The view with a stop of the tour; its control acts on the whole run."""
    if place >= len(TOUR):
        return view
    view = _chosen(view, TOUR[place].preset)
    editing = replace(view.editing, reach=Reach.WHOLE_RUN, gesture=None)
    return replace(view, editing=editing, tour=place)


def _loaded(view: ViewState, name: str, content: bytes) -> ViewState:
    """The view with the scenario of a file, or with its errors."""
    label = f"file {shortened(name)}"
    try:
        draft = Draft.starting_from(label, scenario_from_toml(content, label))
    except ScenarioError as error:
        return replace(view, editing=replace(view.editing, file_errors=error.errors))
    editing = replace(view.editing, file_errors=())
    return _with_draft(replace(view, editing=editing, from_file=draft), draft)
