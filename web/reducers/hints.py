"""The reducer of hints, which are tried before they are shown."""

from __future__ import annotations

import math
from dataclasses import replace

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.hints import HintTrials
from slipgrasp.web.model.intents.hints import HintTried, TryHints
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import RunStage, Shown, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.hints_worker import HintsWorker

REST = 0.4
"""Delay before the hint of a run is tried [s], so that moving controls have priority."""

_SETTLED = (RunStage.PREVIEW, RunStage.SAVING, RunStage.SAVED, RunStage.NOT_SAVED, RunStage.REPLAY)


class HintsReducer(Reducer):
    """Tries the hint of the run on the screen after a pause, if the user may simulate.

    Args:
        service: Service that simulates.
        send: Accepts the answers.
    """

    def __init__(self, service: RunService, send: Send) -> None:
        self._worker = HintsWorker(service, send)
        self.workers = (self._worker,)
        self._may_try = False
        self._number = 0
        self._shown: Shown | None = None
        self._shown_at = -math.inf

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Shows successful options, unless another run is on the screen."""
        self._may_try = self._may_try or isinstance(intent, TryHints)
        if not isinstance(intent, HintTried) or intent.number != self._number:
            return view
        return replace(view, hint_trials=replace(view.hint_trials, tried=intent.tried))

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Starts the trials of a run after a pause; cancels those of an old one."""
        if view.shown is not self._shown:
            self._shown, self._shown_at = view.shown, now
        if view.hint_trials.draft is not None and view.hint_trials.draft is not view.draft:
            self._number += 1
            self._worker.give_up()
            view = replace(view, hint_trials=HintTrials())
        if not self._is_due(view) or now - self._shown_at < REST:
            return view
        assert view.shown is not None, "only a run on the screen is due"
        self._number += 1
        self._worker.try_hint(self._number, view.draft, view.shown.result)
        return replace(view, hint_trials=HintTrials(view.draft))

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until the pause is over."""
        return max(self._shown_at + REST - now, 0.0) if self._is_due(view) else None

    def _is_due(self, view: ViewState) -> bool:
        """Whether the run on the screen belongs to the draft, and its hint was not tried yet."""
        if not self._may_try or view.shown is None or view.shown.ticket != view.ticket:
            return False
        if view.drag is not None or view.status.stage not in _SETTLED:
            return False
        return view.hint_trials.draft is not view.draft
