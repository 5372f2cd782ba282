"""Runs scenarios and keeps what comes out; knows no HTTP.

A simulation releases the GIL in pieces, so threads suffice: a few of them, fed by a
bounded queue, so that neither a request nor a moving slider waits behind the others
for longer than it is told.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from core.result import RunResult
from core.scenario import Scenario
from core.simulator import prepare_kernel, simulate
from recordings.exceptions import RecordingWriteError
from recordings.recorder import record, unsaved
from recordings.recovery import recover_orphans
from recordings.store import RecordingStore, StoredRun
from server.errors import ServiceBusyError
from server.settings import Settings

__all__ = ["Load", "RunService"]

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Load:
    """How many runs are simulated now, and how many wait for their turn."""

    running: int
    waiting: int


class RunService:
    """Simulates and saves, a few runs at a time.

    Args:
        store: Where runs are kept.
        settings: How much to take on, and for how long.
    """

    def __init__(self, store: RecordingStore, settings: Settings) -> None:
        self.store = store
        self._settings = settings
        self._workers = ThreadPoolExecutor(settings.max_running, thread_name_prefix="run")
        self._lock = threading.Lock()
        self._running = 0
        self._admitted = 0
        self._closing = threading.Event()
        self._kernel_ready = threading.Event()

    def start(self) -> None:
        """Recovers what a killed service left, and begins to load or compile the kernel."""
        for recovered in recover_orphans(self._settings.data_directory):
            _logger.warning("recovered '%s' of a run that was killed", recovered.path)
        threading.Thread(target=self._prepare, name="kernel", daemon=True).start()

    def close(self) -> None:
        """Stops what runs, keeps what it has, and forgets what waits."""
        self._closing.set()
        self._workers.shutdown(wait=True, cancel_futures=True)

    @property
    def kernel_is_ready(self) -> bool:
        """Whether the kernel is loaded; the first compilation takes some seconds."""
        return self._kernel_ready.is_set()

    @property
    def load(self) -> Load:
        """How busy the service is."""
        with self._lock:
            return Load(self._running, self._admitted - self._running)

    def preview(
        self, scenario: Scenario, should_stop: Callable[[], bool] | None = None
    ) -> RunResult:
        """Simulates in the calling thread and saves nothing.

        Args:
            scenario: What to simulate.
            should_stop: Asked every few milliseconds whether to end the run as ``stopped``.
        """
        self._prepare()

        def stopped() -> bool:
            return self._closing.is_set() or (should_stop is not None and should_stop())

        return simulate(scenario, should_stop=stopped, wall_limit=self._settings.wall_limit)

    def save(self, result: RunResult) -> StoredRun:
        """Keeps a run.

        Raises:
            RecordingError: If it cannot be written.
        """
        return self.store.save(result)

    def run(self, scenario: Scenario) -> tuple[RunResult, StoredRun | None]:
        """Simulates and saves when it is this run's turn; see `submit`."""
        return self.submit(lambda: scenario).result()

    def submit(
        self, make_scenario: Callable[[], Scenario]
    ) -> Future[tuple[RunResult, StoredRun | None]]:
        """Queues a run.

        Args:
            make_scenario: Gives the scenario, or raises what is wrong with it, in the worker.

        Returns:
            The result, and where it is kept: None if writing it failed, which then is a
            warning of the result.

        Raises:
            ServiceBusyError: If too many runs are waiting.
        """
        limits = self._settings
        with self._lock:
            if self._admitted >= limits.max_running + limits.max_waiting:
                raise ServiceBusyError(self._admitted - self._running, limits.retry_after)
            self._admitted += 1
        future = self._workers.submit(self._run, make_scenario)
        future.add_done_callback(self._release)
        return future

    def _run(self, make_scenario: Callable[[], Scenario]) -> tuple[RunResult, StoredRun | None]:
        with self._lock:
            self._running += 1
        try:
            return self._record(make_scenario())
        finally:
            with self._lock:
                self._running -= 1

    def _record(self, scenario: Scenario) -> tuple[RunResult, StoredRun | None]:
        """Simulates and records at once; where that cannot be begun, only simulates."""
        self._prepare()
        try:
            reservation = self.store.reserve()
        except RecordingWriteError as error:
            _logger.error("a run is simulated but cannot be saved: %s", error)
            return unsaved(self.preview(scenario), error), None
        recorded = record(
            scenario,
            reservation.path,
            should_stop=self._closing.is_set,
            wall_limit=self._settings.wall_limit,
        )
        if recorded.failure is not None:
            _logger.error("a run was simulated but not saved: %s", recorded.failure)
            return recorded.result, None
        return recorded.result, self.store.register(reservation, recorded.result)

    def _release(self, future: Future[tuple[RunResult, StoredRun | None]]) -> None:
        with self._lock:
            self._admitted -= 1

    def _prepare(self) -> None:
        prepare_kernel()
        self._kernel_ready.set()
