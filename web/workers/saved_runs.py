"""Runs already stored by this process, by scenario: equal scenarios give equal runs."""

from __future__ import annotations

import threading
from collections import OrderedDict

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.store.store import StoredRun
from slipgrasp.server.runs.service import RunService

_REMEMBERED = 256


class SavedRuns:
    """Stores each run once, so that reopening the dashboard does not fill the disk.

    Args:
        service: Stores runs.
    """

    def __init__(self, service: RunService) -> None:
        self._service = service
        self._lock = threading.Lock()
        self._ids: OrderedDict[Scenario, str] = OrderedDict()

    def save(self, result: RunResult) -> StoredRun:
        """Stores a run, or returns the stored run of the same scenario.

        Raises:
            RecordingError: If the run cannot be written.
            ServiceBusyError: If no memory becomes free for some time.
        """
        repeatable = result.outcome is Outcome.COMPLETED or result.outcome.ended_by_physics
        if repeatable and (stored := self._find(result.scenario)):
            return stored
        stored = self._service.save(result)
        if repeatable:
            self._remember(result.scenario, stored.id)
        return stored

    def _find(self, scenario: Scenario) -> StoredRun | None:
        with self._lock:
            run_id = self._ids.get(scenario)
        if run_id is None:
            return None
        try:
            return self._service.store.get(run_id)
        except RecordingNotFoundError:
            return None

    def _remember(self, scenario: Scenario, run_id: str) -> None:
        with self._lock:
            self._ids[scenario] = run_id
            while len(self._ids) > _REMEMBERED:
                self._ids.popitem(last=False)
