"""The state of a session's screen: one immutable value, from which scene and panels are drawn."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.run.premises import has_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.measured import Distances
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.draft import Draft, change_time, error_words
from slipgrasp.web.model.editing import Editing
from slipgrasp.web.model.export import Exporting
from slipgrasp.web.model.fit import FitView
from slipgrasp.web.model.hints import HintTrials
from slipgrasp.web.model.laws_view import LawsView
from slipgrasp.web.model.pace import pace_of
from slipgrasp.web.model.page_layout import PageLayout
from slipgrasp.web.model.playback import (
    Playback,
    TimeWindow,
    WindowChoice,
    speed_for,
    start_playback,
    whole_window,
    window_of,
)
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.run_list import RunList
from slipgrasp.web.model.sampling import Sample, Sampler, pushed
from slipgrasp.web.model.selection import Selection
from slipgrasp.web.model.study import StudyView
from slipgrasp.web.model.tour import TOUR, Stop

MOST_ROWS_WITH_PREMISES = 20_000
"""Largest number of rows that are evaluated again, which takes some ten seconds."""

Pair = tuple[int, int]
"""Tickets of two runs: the run on the screen, and the ghost."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparing:
    """The comparison of two runs.

    Attributes:
        pair: The compared runs; None without findings.
        findings: Their differences; None if they cannot be compared.
        message: Reason why the latest request failed, or the runs cannot be compared.
        distances: Deviations of measured data from the run; None if the other is a run.
    """

    pair: Pair | None = None
    findings: Comparison | None = None
    message: str = ""
    distances: Distances | None = None


@dataclass(frozen=True, slots=True)
class HowHeavy:
    """Largest mass of the object that is held.

    Attributes:
        draft: The scenario of the request; None if there is none.
        words: The result, or a note that it is being computed.
    """

    draft: Draft | None = None
    words: str = ""


class RunStage(StrEnum):
    """The stage of the latest request."""

    OPENING = "opening"
    REPLAY = "replay"
    UNREADABLE = "unreadable"
    COMPILING = "compiling"
    SIMULATING = "simulating"
    PREVIEW = "preview"
    SAVING = "saving"
    SAVED = "saved"
    REFUSED = "refused"
    NOT_SAVED = "not saved"


@dataclass(frozen=True, slots=True)
class RunStatus:
    """The status of the latest request.

    Attributes:
        stage: Its stage.
        messages: Errors, a sentence each; while compiling, the progress.
        run_id: The id of the stored run; empty unless saved.
        errors: Errors by field, if the scenario was refused.
    """

    stage: RunStage
    messages: tuple[str, ...] = ()
    run_id: str = ""
    errors: tuple[FieldError, ...] = ()

    @classmethod
    def refused(cls, error: ScenarioError) -> RunStatus:
        """A scenario that cannot be simulated."""
        messages = tuple(map(error_words, error.errors))
        return cls(RunStage.REFUSED, messages, errors=error.errors)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A run on the screen.

    Attributes:
        ticket: The request that it answers; another ticket is another run.
        result: The run.
        elapsed: Computing time [s]; 0 if it was read.
        replay: The recording from which it was read, None if it was computed.
        sampler: Samples instants of the run.
    """

    ticket: int
    result: RunResult
    elapsed: float
    replay: Replay | None = None
    sampler: Sampler = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sampler", Sampler(self.result.trace))

    @property
    def is_measured(self) -> bool:
        """Whether it holds measured data, which have no hand and no phases."""
        return self.replay is not None and self.replay.measured is not None

    @property
    def name(self) -> str:
        """The name of its recording, or its preset with the differences from it."""
        return self.replay.name if self.replay else self.result.name


class Drag(NamedTuple):
    """The object is being dragged.

    Attributes:
        force: The force, a number per direction [N].
        playback: The play head at the start; the force acts from then on.
        draft: The draft at the start.
        editing: The state of editing at the start.
    """

    force: tuple[float, ...]
    playback: Playback
    draft: Draft
    editing: Editing


class ShownPremises(NamedTuple):
    """The assumptions of the paper's theorems, compared with a run.

    Attributes:
        ticket: The run.
        sentences: The comparison; empty while it is computed.
    """

    ticket: int
    sentences: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Ghost:
    """Another run, drawn pale below the run on the screen.

    Attributes:
        shown: The run.
        label: Its name, which shows its origin.
        is_chosen: Whether the user selected it for a comparison; it then remains when controls
            move.
    """

    shown: Shown
    label: str
    is_chosen: bool = False

    @property
    def run(self) -> RunResult | None:
        """The run; None if it is measured data."""
        return None if self.shown.is_measured else self.shown.result

    @property
    def drawn(self) -> RunResult | None:
        """The run to draw in the scene; None for measured data without a complete pose."""
        result = self.shown.result
        return result if np.isfinite(result.trace.object_pose[0]).all() else None


@dataclass(frozen=True, eq=False)
class ViewState:
    """The content of the screen of one session at one moment.

    Attributes:
        draft: The scenario that the user edits.
        status: The status of its run.
        choice: The time range of a run that is shown.
        ticket: The latest request for a run; answers to older ones are ignored.
        opening: The latest request for a recording; answers to older ones are ignored.
        shown: The run on the screen.
        ghost: The run that is drawn pale below it.
        playback: The play head.
        run_list: The list of stored runs.
        comparing: The comparison of the run on the screen and the ghost.
        replay: The recording that was opened last, to which the user can return.
        from_file: The scenario of the file that was opened last, without edits; the user can
            return to it too.
        notice: A message across all panels; empty if there is none.
        charts: The user's settings of the charts.
        laws: Runs with every law, while their tab is visible.
        how_heavy: Largest mass of the object that is held, if requested.
        hint_trials: Results of simulating the hints.
        exporting: The file that is being exported.
        editing: The state of editing, and earlier drafts.
        selection: The part of the scenario whose controls are shown.
        appearance: The appearance of the view.
        page_layout: The size of the page; None until the page has reported it.
        restored: Number of times that the layout of the panels was restored.
        study: The planned study, and the one whose progress is shown.
        fit: The fit on the screen.
        premises: The assumptions of the theorems for a run, once requested.
        tour: Index of the most recent stop of the tour; None outside the tour.
        drag: The current drag of the object; None without one.
    """

    draft: Draft
    status: RunStatus
    choice: WindowChoice
    ticket: int = 0
    opening: int = 0
    shown: Shown | None = None
    ghost: Ghost | None = None
    playback: Playback | None = None
    run_list: RunList = field(default_factory=RunList)
    comparing: Comparing = field(default_factory=Comparing)
    replay: Replay | None = None
    from_file: Draft | None = None
    notice: str = ""
    charts: ChartsView = field(default_factory=ChartsView)
    laws: LawsView = field(default_factory=LawsView)
    how_heavy: HowHeavy = field(default_factory=HowHeavy)
    hint_trials: HintTrials = field(default_factory=HintTrials)
    exporting: Exporting = field(default_factory=Exporting)
    editing: Editing = field(default_factory=Editing)
    selection: Selection = field(default_factory=Selection)
    appearance: Appearance = field(default_factory=Appearance)
    page_layout: PageLayout | None = None
    restored: int = 0
    study: StudyView = field(default_factory=StudyView)
    fit: FitView = field(default_factory=FitView)
    premises: ShownPremises | None = None
    tour: int | None = None
    drag: Drag | None = None

    @property
    def stop(self) -> Stop | None:
        """The stop of the tour on the screen; None if another preset is shown."""
        stop = None if self.tour is None else TOUR[self.tour]
        return stop if stop is not None and self.draft.origin == stop.preset else None

    @property
    def moment(self) -> float:
        """The time of a change at the play head [s]."""
        return change_time(self.playback.time) if self.playback else 0.0

    @property
    def offers_premises(self) -> bool:
        """Whether the assumptions of the theorems can be requested for the run on the screen."""
        if self.shown is None or not has_premises(self.shown.result.scenario):
            return False
        asked = self.premises is not None and self.premises.ticket == self.shown.ticket
        return not asked and len(self.shown.result.trace) <= MOST_ROWS_WITH_PREMISES

    @property
    def is_as_recorded(self) -> bool:
        """Whether the draft equals the recording that was opened last."""
        label = self.replay.label if self.replay else None
        return self.draft.origin == label and not self.draft.is_touched

    @cached_property
    def sample(self) -> Sample | None:
        """The instant of the run that is shown, at the play head; pushed as the user drags."""
        sample = self._sample_of(self.shown)
        return sample if self.drag is None or sample is None else pushed(sample, self.drag.force)

    @cached_property
    def ghost_sample(self) -> Sample | None:
        """The instant of the ghost, at the play head."""
        is_drawn = self.ghost is not None and self.ghost.drawn is not None
        return self._sample_of(self.ghost.shown if self.ghost and is_drawn else None)

    def _sample_of(self, shown: Shown | None) -> Sample | None:
        if shown is None or self.playback is None:
            return None
        return shown.sampler.at(self.playback.time)


def show(view: ViewState, shown: Shown, stage: RunStage, *, afresh: bool) -> ViewState:
    """Puts a run on the screen.

    Args:
        view: The current screen.
        shown: The run.
        stage: The stage of its request.
        afresh: Whether it is unrelated to the previous run, so that the play head returns to the
            start.
            Otherwise the play head stays, up to the end of the run.
    """
    playback, choice = view.playback, view.choice
    if playback is None or afresh:
        playback, choice = start_playback(shown.result), WindowChoice.SLIP
    else:
        if playback.pace is not None:
            playback = replace(playback, pace=pace_of(shown.result))
        playback = _kept_in(window_of(shown.result, choice, playback.window), playback, shown)
    return replace(view, shown=shown, playback=playback, choice=choice, status=RunStatus(stage))


def _kept_in(window: TimeWindow, playback: Playback, shown: Shown) -> Playback:
    """The play head in the window of another run; if it is paused, the window is extended to it.

    Otherwise a control would not act at the time of the pause.
    """
    if not playback.playing:
        time = whole_window(shown.result).clamp(playback.time)
        window = TimeWindow(min(window.start, time), max(window.end, time))
    # A speed that the user has not chosen is adapted to the window.
    is_own = playback.speed != speed_for(playback.window)
    speed = playback.speed if is_own else speed_for(window)
    return replace(playback.within(window), speed=speed)


def replays_of(view: ViewState) -> tuple[Replay, ...]:
    """The recordings that a page has in memory."""
    shown = (view.shown, view.ghost.shown if view.ghost else None)
    replays = (view.replay, *(run.replay for run in shown if run is not None))
    return tuple(replay for replay in replays if replay is not None)


def show_replay(view: ViewState, recording: Replay) -> ViewState:
    """Puts a recording on the screen; a run in progress is ignored."""
    ticket, draft, editing = view.ticket + 1, Draft.from_replay(recording), view.editing
    afresh = draft.origin != view.draft.origin
    if view.shown is not None and draft != view.draft:
        editing = editing.begin(view.draft)
    view = replace(view, ticket=ticket, draft=draft, editing=editing, replay=recording, ghost=None)
    shown = Shown(ticket, recording.result, 0.0, recording)
    return show(view, shown, RunStage.REPLAY, afresh=afresh)
