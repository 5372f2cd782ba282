"""A run that was asked for and has not ended: it waits for its turn, or is simulated."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from enum import StrEnum

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.store.stored_run import StoredRun

Ended = tuple[RunResult, StoredRun | None]
"""A run that has ended, and how it is kept: None if it could not be written."""


class RunState(StrEnum):
    """What becomes of a run before it has ended."""

    WAITING = "waiting"
    RUNNING = "running"


class PendingRun:
    """A run on its way; safe to use from several threads.

    Args:
        run_id: Its name in the store.
        make_scenario: Gives what to simulate.

    Attributes:
        id: Its name in the store.
        make_scenario: Gives what to simulate.
        future: The run once it has ended; it cannot be cancelled.
        progress: Simulated share, 0 to 1.
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
        """What becomes of it now."""
        return RunState.RUNNING if self._begun.locked() else RunState.WAITING

    @property
    def is_to_stop(self) -> bool:
        """Whether somebody wants it to end."""
        return self._stop.is_set()

    def begin(self) -> bool:
        """Marks it as begun; False if somebody else has begun it."""
        return self._begun.acquire(blocking=False)

    def watch(self, progress: float) -> None:
        """Takes down how far it is, 0 to 1."""
        self.progress = progress

    def stop(self) -> None:
        """Asks it to end as soon as possible."""
        self._stop.set()

    def done(self) -> bool:
        """Whether it has ended."""
        return self.future.done()

    def result(self) -> Ended:
        """Waits for its end.

        Raises:
            ScenarioError: If it cannot be simulated.
            SlipgraspError: If it was never begun, or could not be recorded.
        """
        return self.future.result()
