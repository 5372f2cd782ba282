"""Runs in the memory of pages, by scenario: pages with equal scenarios share one run."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary, WeakValueDictionary

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.trace.types import Outcome
from slipgrasp.server.runs.service import RunService


class LiveRun(NamedTuple):
    """A simulated run.

    Attributes:
        result: The run.
        elapsed: Computing time [s].
    """

    result: RunResult
    elapsed: float


class LiveRuns:
    """Simulates for pages; a run that a page still has is not simulated again.

    Equal scenarios give equal runs, except with a custom law, whose code may have changed.

    Args:
        service: Simulates scenarios.

    Attributes:
        preparation: The progress of compiling the simulation for this machine.
    """

    def __init__(self, service: RunService) -> None:
        self._service, self.preparation = service, service.preparation
        # The entries disappear with the last page that has the run.
        self._runs: WeakValueDictionary[Scenario, RunResult] = WeakValueDictionary()
        self._elapsed: WeakKeyDictionary[RunResult, float] = WeakKeyDictionary()
        self._lock = threading.Lock()

    def simulate(self, scenario: Scenario, should_stop: Callable[[], bool]) -> LiveRun:
        """Simulates in the calling thread, or returns the run of a page.

        Args:
            scenario: Scenario to simulate.
            should_stop: Called every few milliseconds; returns whether to stop the run.

        Raises:
            ScenarioError: If it cannot be simulated.
            MemoryLimitError: If its samples need more memory than the limit.
            ServiceBusyError: If the memory is in use.
        """
        self._service.prepare()  # compilation does not count as computing time
        with self._lock:
            known = self._runs.get(scenario)
            if known is not None:
                return LiveRun(known, self._elapsed[known])
        started = time.monotonic()
        result = self._service.preview(scenario, should_stop)
        return self._share(LiveRun(result, time.monotonic() - started))

    def _share(self, run: LiveRun) -> LiveRun:
        """Offers a run to other pages; returns theirs if one has simulated it meanwhile."""
        result = run.result
        is_repeatable = result.outcome is Outcome.COMPLETED or result.outcome.ended_by_physics
        if not is_repeatable or custom_law_in(result.scenario) is not None:
            return run
        with self._lock:
            shared = self._runs.setdefault(result.scenario, result)
            elapsed = self._elapsed.setdefault(shared, run.elapsed)
        return LiveRun(shared, elapsed)
