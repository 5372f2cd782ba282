"""The reducer of the laws side by side."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.charts.law_charts import LAWS_TAB
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.laws import LawRunFinished
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.laws_worker import LawsWorker

REST = 0.4
"""How long the draft rests before every law is run [s]: a control in hand has the processor."""


class LawsReducer(Reducer):
    """Has the scenario run with every law while their tab is in sight.

    Args:
        service: Simulates.
        send: Takes the runs.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (LawRunFinished,)

    def __init__(self, service: RunService, send: Send) -> None:
        self._service, self._send = service, send
        self._worker: LawsWorker | None = None
        self._number = 0
        self._draft: Draft | None = None
        self._moved_at = -math.inf

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Shows a run, unless it comes too late."""
        if not isinstance(intent, LawRunFinished) or intent.number != self._number:
            return view
        return replace(view, laws=view.laws.with_run(intent.run))

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Asks for the runs of a draft that rests, if they are looked at."""
        if view.draft is not self._draft:
            self._draft, self._moved_at = view.draft, now
        if not self._is_due(view) or now - self._moved_at < REST:
            return view
        if self._worker is None:
            # Most sessions never look at this: they need no thread.
            self._worker = LawsWorker(self._service, self._send)
            self.workers = (self._worker,)
        self._number += 1
        self._worker.compare(self._number, view.draft)
        return replace(view, laws=replace(view.laws, draft=view.draft))

    def wait(self, now: float, view: ViewState) -> float | None:
        """Until the draft has rested."""
        return max(self._moved_at + REST - now, 0.0) if self._is_due(view) else None

    def _is_due(self, view: ViewState) -> bool:
        return LAWS_TAB in view.charts.seen and view.laws.draft is not view.draft
