"""The reducer of what is suggested after a run, which is tried before it is offered."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.hints import HintTrials
from slipgrasp.web.model.intents.hints import HintTried, TryHints
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import RunStage, Shown, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.hints_worker import HintsWorker

REST = 0.4
"""How long a run is on the screen before its hint is tried [s]: a slider in hand goes first."""

_SETTLED = (RunStage.PREVIEW, RunStage.SAVING, RunStage.SAVED, RunStage.NOT_SAVED, RunStage.REPLAY)


class HintsReducer(Reducer):
    """Has the hint of the run on the screen tried once it rests, if its viewer may compute.

    Args:
        service: Simulates.
        send: Takes the answers.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (TryHints, HintTried)

    def __init__(self, service: RunService, send: Send) -> None:
        self._worker = HintsWorker(service, send)
        self.workers = (self._worker,)
        self._may_try = False
        self._number = 0
        self._shown: Shown | None = None
        self._shown_at = -math.inf

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Shows what helps, unless another run is on the screen by now."""
        self._may_try = self._may_try or isinstance(intent, TryHints)
        if not isinstance(intent, HintTried) or intent.number != self._number:
            return view
        return replace(view, hint_trials=replace(view.hint_trials, tried=intent.tried))

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Asks for the trials of a run that rests; gives up those of one that is gone."""
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
        """Until the run has rested."""
        return max(self._shown_at + REST - now, 0.0) if self._is_due(view) else None

    def _is_due(self, view: ViewState) -> bool:
        """Whether the run on the screen is that of the draft, and its hint not tried yet."""
        if not self._may_try or view.shown is None or view.shown.ticket != view.ticket:
            return False
        if view.drag is not None or view.status.stage not in _SETTLED:
            return False
        return view.hint_trials.draft is not view.draft
