"""The reducer of the runs with every law."""

from __future__ import annotations

import math
from dataclasses import replace

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.charts.law_charts import LAWS_TAB
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.laws import LawRunFinished
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.laws_worker import LawsWorker

REST = 0.4
"""Delay before every law is run [s], so that moving controls have priority."""


class LawsReducer(Reducer):
    """Runs the scenario with every law while their tab is visible.

    Args:
        service: Service that simulates.
        send: Accepts the runs.
    """

    def __init__(self, service: RunService, send: Send) -> None:
        self._worker = LawsWorker(service, send)
        self.workers = (self._worker,)
        self._number = 0
        self._draft: Draft | None = None
        self._moved_at = -math.inf

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Shows a run, unless it is outdated."""
        if not isinstance(intent, LawRunFinished) or intent.number != self._number:
            return view
        return replace(view, laws=view.laws.with_run(intent.run))

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Requests the runs of a draft after a pause, if the tab is visible."""
        if view.draft is not self._draft:
            self._draft, self._moved_at = view.draft, now
        if not self._is_due(view) or now - self._moved_at < REST:
            return view
        self._number += 1
        self._worker.compare(self._number, view.draft)
        return replace(view, laws=replace(view.laws, draft=view.draft))

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until the pause is over."""
        return max(self._moved_at + REST - now, 0.0) if self._is_due(view) else None

    def _is_due(self, view: ViewState) -> bool:
        if not view.draft.base.space.has_hand:
            return False
        return LAWS_TAB in view.charts.seen and view.laws.draft is not view.draft
