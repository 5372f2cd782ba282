"""The reducer of runs: simulates the draft, shows the run, and stores it after a pause."""

from __future__ import annotations

import math
from dataclasses import replace

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.server.runs.preparation import Preparation
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.runs import RunFinished, RunRefused, RunSaved, SaveFailed
from slipgrasp.web.model.view import (
    Ghost,
    RunStage,
    RunStatus,
    Shown,
    ViewState,
    show,
    show_replay,
)
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.preview_worker import PreviewWorker
from slipgrasp.web.workers.saved_runs import SavedRuns

_UNNOTICED_WAIT = 0.3
_POLL_INTERVAL = 0.1
_REST_BEFORE_SAVING = 0.5
_SHORT_RUN = 0.1
_PATIENCE = 0.5
_GHOST_LABEL = "the run before"


def is_save_due(stage: RunStage, rested: float) -> bool:
    """Whether to store the run on the screen now.

    Args:
        stage: The stage of the latest request.
        rested: Time since the last move of a control [s].
    """
    return stage is RunStage.PREVIEW and rested >= _REST_BEFORE_SAVING


class RunReducer(Reducer):
    """Turns the draft into a run.

    Args:
        live: Simulates scenarios.
        saved: Stores runs.
        send: Accepts the worker's answers.
        simulates_first: Whether it starts with the run of the first draft.
    """

    def __init__(
        self,
        live: LiveRuns,
        saved: SavedRuns,
        send: Send,
        *,
        simulates_first: bool,
    ) -> None:
        self._worker = PreviewWorker(live, saved, send)
        self.workers = (self._worker,)
        self._preparation = live.preparation
        self._simulates_first = simulates_first
        self._asked: Draft | None = None
        self._base: Scenario | None = None
        self._asked_at = -math.inf
        self._waiting_since: float | None = None

    def start(self, view: ViewState) -> ViewState:
        """Requests the run of the first draft at the first tick."""
        self._asked = None if self._simulates_first else view.draft
        return view

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Shows the worker's answer, unless it is outdated."""
        match intent:
            case RunFinished() | RunRefused() | RunSaved() | SaveFailed():
                return view if intent.ticket != view.ticket else self._answered(intent, view)
            case _:
                return view

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Requests the run of a new draft, stores one that rests, and reports a long one.

        Runs that are not slow are awaited: a control that moves faster than its runs would
        otherwise never show any.
        """
        if view.draft is not self._asked and not self._is_patient(now):
            return self._ask(now, view)
        rests = view.drag is None and is_save_due(view.status.stage, now - self._asked_at)
        if view.shown and rests:
            self._worker.save(view.shown.ticket, view.shown.result)
            return replace(view, status=RunStatus(RunStage.SAVING))
        if self._waiting_since is not None and now - self._waiting_since > _UNNOTICED_WAIT:
            return replace(view, status=_busy_status(self._preparation))
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Immediately for a new draft; later if a run is computed or to be stored."""
        if view.draft is not self._asked:
            return _POLL_INTERVAL if self._is_patient(now) else 0.0
        if self._waiting_since is not None and self.expects_answer(now):
            return self._waiting_since + _SHORT_RUN - now
        busy = self._waiting_since is not None or view.status.stage is RunStage.PREVIEW
        return _POLL_INTERVAL if busy else None

    def expects_answer(self, now: float) -> bool:
        """Whether a run was requested just now: a frame without its result would delay that."""
        return self._waiting_since is not None and now - self._waiting_since < _SHORT_RUN

    def _is_patient(self, now: float) -> bool:
        return self._waiting_since is not None and now - self._asked_at < _PATIENCE

    def _answered(
        self, answer: RunFinished | RunRefused | RunSaved | SaveFailed, view: ViewState
    ) -> ViewState:
        match answer:
            case RunFinished(ticket, result, elapsed):
                self._waiting_since = None
                return self._show(Shown(ticket, result, elapsed), view)
            case RunRefused(_, error):
                self._waiting_since = None
                return replace(view, status=RunStatus.refused(error))
            case RunSaved(_, stored):
                return replace(view, status=RunStatus(RunStage.SAVED, run_id=stored.id))
            case SaveFailed(_, message):
                return replace(view, status=RunStatus(RunStage.NOT_SAVED, (message,)))

    def _show(self, shown: Shown, view: ViewState) -> ViewState:
        """Shows a run; the previous one becomes the ghost if a gesture began with it."""
        afresh = view.draft.base is not self._base
        self._base = view.draft.base
        ghost = None if afresh and not (view.ghost and view.ghost.is_chosen) else view.ghost
        if view.editing.ghost_due and not afresh and view.shown and not (ghost and ghost.is_chosen):
            ghost = Ghost(view.shown, f"{_GHOST_LABEL}: {view.shown.name}")
        editing = replace(view.editing, ghost_due=False)
        view = replace(view, ghost=ghost, editing=editing)
        return show(view, shown, RunStage.PREVIEW, afresh=afresh)

    def _ask(self, now: float, view: ViewState) -> ViewState:
        """Requests the run of the draft, which replaces an older request."""
        self._asked_at = now
        if view.is_as_recorded:
            view = self._replay(view)
            self._asked, self._base, self._waiting_since = view.draft, view.draft.base, None
            return view
        self._asked = view.draft
        view = replace(view, ticket=view.ticket + 1)
        try:
            scenario = view.draft.scenario()
        except ScenarioError as error:
            self._waiting_since = None
            return replace(view, status=RunStatus.refused(error))
        if self._waiting_since is None:
            self._waiting_since = now
        self._worker.simulate(view.ticket, scenario)
        return view

    def _replay(self, view: ViewState) -> ViewState:
        """Shows the recording of the draft, unless it is on the screen already."""
        on_screen = view.shown is not None and view.shown.ticket == view.ticket
        if on_screen and view.status.stage is RunStage.REPLAY:
            return view
        assert view.replay is not None
        return show_replay(view, view.replay)


def _busy_status(preparation: Preparation) -> RunStatus:
    if compiling := preparation.words():
        return RunStatus(RunStage.COMPILING, (compiling,))
    return RunStatus(RunStage.SIMULATING)
