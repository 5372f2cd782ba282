"""A requested run that has not ended: queued or being simulated."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from enum import StrEnum

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.store.stored_run import StoredRun

Ended = tuple[RunResult, StoredRun | None]
"""An ended run, and its stored form: None if that is incomplete."""


class RunState(StrEnum):
    """State of a run before its end."""

    WAITING = "waiting"
    RUNNING = "running"


class PendingRun:
    """A pending run; thread-safe.

    Args:
        run_id: Its id.
        make_scenario: Returns the scenario.

    Attributes:
        id: Its id.
        make_scenario: Returns the scenario.
        future: The run after its end; it cannot be cancelled.
        progress: Simulated fraction, 0 to 1.
    """

    def __init__(self, run_id: str, make_scenario: Callable[[], Scenario]) -> None:
        self.id = run_id
        self.make_scenario = make_scenario
        self.future: Future[Ended] = Future()
        self.future.set_running_or_notify_cancel()
        self.progress = 0.0
        self._begun = threading.Lock()
        self._stop = threading.Event()

    @property
    def state(self) -> RunState:
        """Current state of the run."""
        return RunState.RUNNING if self._begun.locked() else RunState.WAITING

    @property
    def is_to_stop(self) -> bool:
        """Whether its end was requested."""
        return self._stop.is_set()

    def begin(self) -> bool:
        """Marks it as started; returns False if it was already."""
        return self._begun.acquire(blocking=False)

    def watch(self, progress: float) -> None:
        """Stores the progress, 0 to 1."""
        self.progress = progress

    def stop(self) -> None:
        """Requests its end."""
        self._stop.set()

    def done(self) -> bool:
        """Whether it has ended."""
        return self.future.done()

    def result(self) -> Ended:
        """Waits for its end.

        Raises:
            ScenarioError: If it cannot be simulated.
            SlipgraspError: If it was never started, or could not be recorded.
        """
        return self.future.result()
