"""Simulates scenarios and stores their recordings; independent of HTTP.

A simulation releases the GIL, so threads suffice: a few of them, fed by a bounded queue, so that
the waiting time of a request or a moving slider is bounded. A custom law, which may run any code,
runs in another process.
"""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import prepare_kernel, simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.exceptions import (
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
    StorageFullError,
    told_within,
)
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.isolated_run import IsolatedRuns, needs_isolation, record_or_say_why
from slipgrasp.recordings.file.size import size_of_run
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.store import RecordingStore, StoredRun
from slipgrasp.server.budget import MemoryBudget, Need, default_limit
from slipgrasp.server.exceptions import (
    IdempotencyKeyReusedError,
    RunForgottenError,
    RunUnfinishedError,
    RunUnrecordableError,
    ServiceBusyError,
    ServiceEndingError,
)
from slipgrasp.server.request_keys import KEYS_NAME, KeyedRequest, RequestKeys
from slipgrasp.server.runs.pending import Ended, PendingRun
from slipgrasp.server.runs.preparation import Preparation
from slipgrasp.server.runs.recovery import RunRecovery
from slipgrasp.server.settings import Settings

MAX_UNSAVED = 100

Unsaved = Description | RunUnrecordableError | StorageFullError
"""The description of a run without a recording."""

_UNRECORDABLE = (RunUnrecordableError, StorageFullError)

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Load:
    """The numbers of running and of waiting runs."""

    running: int
    waiting: int


class RunService:
    """Simulates and stores runs, a few at a time.

    Args:
        store: The store of runs.
        settings: The limits.
        is_ending: Whether the service is about to end; it then accepts no runs, and stops running
            ones.

    Attributes:
        memory: The budget of memory of the server.
        preparation: The progress of compiling the simulation for this machine.
    """

    def __init__(
        self,
        store: RecordingStore,
        settings: Settings,
        is_ending: Callable[[], bool] = lambda: False,
    ) -> None:
        self.store = store
        self.memory = MemoryBudget(settings.memory_bytes or default_limit())
        self._settings = settings
        self._is_ending = is_ending
        self._workers = ThreadPoolExecutor(settings.max_running, thread_name_prefix="run")
        # A run that is stopped before its turn would otherwise wait for it.
        self._stopper = ThreadPoolExecutor(1, thread_name_prefix="stop")
        self._lock = threading.Lock()
        self._pending: dict[str, PendingRun] = {}
        self._unsaved: OrderedDict[str, Unsaved] = OrderedDict()
        self._running = 0
        self._keys = RequestKeys(settings.data_directory / KEYS_NAME)
        self._keys_lock = threading.Lock()
        self._closing = threading.Event()
        self._kernel_ready = threading.Event()
        self.preparation = Preparation()
        self._recovery = RunRecovery(store, settings.data_directory)
        self._isolated_runs = IsolatedRuns(settings.wall_limit, settings.max_running)

    def start(self) -> None:
        """Starts to recover the runs of a killed service, and to load or compile the kernel."""
        self._recovery.start()
        self.preparation.look()
        threading.Thread(target=self.prepare, name="kernel", daemon=True).start()

    def close(self) -> None:
        """Stops and stores running runs, and drops waiting ones."""
        self._closing.set()
        self._recovery.close()
        self._isolated_runs.close()
        for workers in (self._workers, self._stopper):
            workers.shutdown(wait=True, cancel_futures=True)

    @property
    def kernel_is_ready(self) -> bool:
        """Whether the kernel is loaded; compiling it for the first time can take minutes."""
        return self._kernel_ready.is_set()

    @property
    def recovering(self) -> list[str]:
        """Runs cut off by a kill or a full disk that are still to be recovered."""
        return self._recovery.run_ids

    @property
    def is_recovered(self) -> threading.Event:
        """Set when all runs of a killed service are recovered."""
        return self._recovery.is_done

    @property
    def load(self) -> Load:
        """The load of the service."""
        with self._lock:
            return Load(self._running, max(len(self._pending) - self._running, 0))

    def obstacles(self) -> list[str]:
        """Reasons why no run can be accepted now, in sentences; empty if one can."""
        waiting = self.load.waiting
        hindered = {
            "the service is about to end": self._is_ending(),
            self._words_on_kernel(): not self.kernel_is_ready,
            f"{waiting} runs are waiting already": waiting >= self._settings.max_waiting,
        }
        found = [sentence for sentence, holds in hindered.items() if holds]
        try:
            self.store.check_writable()
        except RecordingError as error:
            found.append(told_within(error, self._settings.data_directory))
        return found

    def _words_on_kernel(self) -> str:
        if words := self.preparation.words():
            return f"the simulation is still being compiled for this machine, once: {words}"
        return "the simulation is being loaded"

    def preview(
        self, scenario: Scenario, should_stop: Callable[[], bool] | None = None
    ) -> RunResult:
        """Simulates in the calling thread, without storing the run.

        Args:
            scenario: Scenario to simulate.
            should_stop: Called every few milliseconds; returns whether to stop the run.

        Raises:
            ScenarioError: If it cannot be simulated.
            MemoryLimitError: If its samples need more memory than the limit.
            ServiceBusyError: If the memory is in use.
        """
        check_scenario(scenario)
        self.prepare()

        def stopped() -> bool:
            return self._must_stop() or (should_stop is not None and should_stop())

        with self.memory.reserve_to_hold(Need.to_keep_run(scenario)) as lease:
            if needs_isolation(scenario):
                result = self._isolated_runs.simulate(scenario, stopped)
            else:
                limit = self._settings.wall_limit
                result = _compact(simulate(scenario, should_stop=stopped, wall_limit=limit))
            lease.keep(result, size_of_run(result))
        return result

    def save(self, result: RunResult) -> StoredRun:
        """Stores a run.

        Raises:
            RecordingError: If it cannot be written.
            ServiceBusyError: If the memory to write it stays in use for some time.
        """
        with self.memory.reserve(Need.to_work_on(result)):
            return self.store.save(result)

    def submit(self, make_scenario: Callable[[], Scenario]) -> PendingRun:
        """Queues a run.

        Args:
            make_scenario: Returns the scenario, or raises its errors, in the worker.

        Returns:
            The pending run. Its result includes the stored run, or None if writing it failed; the
            outcome is then ``failed``.

        Raises:
            ServiceBusyError: If too many runs are waiting.
            ServiceEndingError: If the service is about to end.
            MemoryLimitError: If a run needs more memory than the limit.
            StorageFullError: If there is no space for another.
            RunUnrecordableError: If nothing can be written.
        """
        if self._is_ending():
            raise ServiceEndingError
        self.memory.check(Need.to_record_run())
        limits = self._settings
        try:
            self.store.check_space()
        except RecordingWriteError as error:
            raise RunUnrecordableError(error) from error
        pending = PendingRun(self.store.new_id(), make_scenario)
        with self._lock:
            num_pending = len(self._pending)
            if num_pending >= limits.max_running + limits.max_waiting:
                waiting = num_pending - self._running
                raise ServiceBusyError(f"{waiting} runs are waiting already")
            self._pending[pending.id] = pending
        self._queue(self._workers, pending)
        return pending

    def submit_once(
        self, make_scenario: Callable[[], Scenario], request: KeyedRequest
    ) -> PendingRun | StoredRun | Description:
        """Queues a run, or finds the run that the same request has already created.

        A run that was deleted, or that did not start because the service ended or the disk was
        full, is simulated again.

        Raises:
            IdempotencyKeyReusedError: If another request had this key.
            ServiceBusyError: If too many runs are waiting.
            ServiceEndingError: If the service is about to end.
            StorageFullError: If there is no space for another.
            RunUnrecordableError: If nothing can be written.
        """
        with self._keys_lock:
            digest, run_id = self._keys.find(request.key) or ("", "")
            if run_id and (found := self._find_made(run_id)) is not None:
                if digest != request.digest:
                    raise IdempotencyKeyReusedError(f"run '{run_id}'")
                return found
            pending = self.submit(make_scenario)
            self._keys.remember(request, pending.id)
            return pending

    def look_up(self, run_id: str) -> PendingRun | StoredRun | Description:
        """A pending run, a stored run, or the failure of a run that was not stored.

        Raises:
            RecordingNotFoundError: If it does not exist.
            StorageFullError: If there was no space for it.
            RunUnrecordableError: If none of it could be written.
        """
        found = self._find(run_id)
        if found is None:
            raise RecordingNotFoundError(run_id)
        return found

    def check_ended(self, run_id: str) -> None:
        """Checks that a run has ended.

        Raises:
            RunUnfinishedError: If it has not.
            ServiceBusyError: If it is still being recovered.
        """
        self._check_recovered(run_id)
        with self._lock:
            if run_id in self._pending:
                raise RunUnfinishedError(run_id)

    def get(self, run_id: str) -> StoredRun:
        """A stored run.

        Raises:
            RunUnfinishedError: If the run has not ended.
            RecordingNotFoundError: If it does not exist.
        """
        self.check_ended(run_id)
        return self.store.get(run_id)

    def stop(self, run_id: str) -> PendingRun | StoredRun | Description:
        """Stops a run and stores its samples; an ended run is not changed.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        found = self.look_up(run_id)
        if isinstance(found, PendingRun):
            found.stop()
            self._queue(self._stopper, found)
        return found

    def _find(self, run_id: str) -> PendingRun | StoredRun | Description | None:
        self._check_recovered(run_id)
        with self._lock:
            pending, unsaved = self._pending.get(run_id), self._unsaved.get(run_id)
        if pending is not None:
            return pending
        # A run that a full disk interrupted may have been recovered in the meantime.
        with suppress(RecordingNotFoundError):
            return self.store.get(run_id)
        if isinstance(unsaved, SlipgraspError):
            raise unsaved
        return unsaved

    def _check_recovered(self, run_id: str) -> None:
        if self._recovery.is_orphan(run_id):
            raise ServiceBusyError(
                f"run '{run_id}' is being recovered from a service that was killed"
            )

    def _find_made(self, run_id: str) -> PendingRun | StoredRun | Description | None:
        with suppress(*_UNRECORDABLE):
            return self._find(run_id)
        return None

    def _queue(self, workers: ThreadPoolExecutor, pending: PendingRun) -> None:
        try:
            workers.submit(self._run, pending).add_done_callback(partial(self._settle, pending))
        except RuntimeError:
            # The service is closing, and its workers accept nothing.
            self._forget(pending)

    def _run(self, pending: PendingRun) -> Ended | None:
        """Simulates and records; None if it has already started, or the service is ending."""
        if self._must_stop():
            self._forget(pending)
            return None
        if not pending.begin():
            return None
        with self._lock:
            self._running += 1
        try:
            return self._record(pending)
        finally:
            with self._lock:
                self._running -= 1

    def _record(self, pending: PendingRun) -> Ended:
        """Simulates and records; a run that cannot be recorded does not start."""
        scenario = pending.make_scenario()
        self.prepare()

        try:
            reservation = self.store.reserve(run_id=pending.id)
            with self.memory.reserve(Need.to_record_run(), self._is_not_needed(pending)):
                result, failure = self._simulate(scenario, reservation.path, pending)
        except RecordingWriteError as error:
            raise RunUnrecordableError(error) from error
        if failure is None:
            return result, self.store.register(reservation, result)
        _logger.error("a run was not saved: %s", failure)
        if (part := part_of(reservation.path)).exists():
            self._recovery.note_cut_off(part)
        return result, None

    def _simulate(
        self, scenario: Scenario, path: Path, pending: PendingRun
    ) -> tuple[RunResult, str | None]:
        """The run, and the error that made its recording incomplete, if any."""
        should_stop = self._is_not_needed(pending)
        if needs_isolation(scenario):
            return self._isolated_runs.record(scenario, path, should_stop, pending.watch)
        limit = self._settings.wall_limit
        return record_or_say_why(scenario, path, should_stop, pending.watch, limit)

    def _is_not_needed(self, pending: PendingRun) -> Callable[[], bool]:
        return lambda: pending.is_to_stop or self._must_stop()

    def _settle(self, pending: PendingRun, work: Future[Ended | None]) -> None:
        """Removes an ended run from the pending ones, then notifies waiting requests."""
        if work.cancelled():
            self._forget(pending)
        elif (error := work.exception()) is not None:
            self._let_go(pending, error if isinstance(error, _UNRECORDABLE) else None)
            pending.future.set_exception(error)
        elif (ended := work.result()) is not None:
            result, stored = ended
            self._let_go(pending, None if stored else Description.from_result(result))
            pending.future.set_result(ended)

    def _forget(self, pending: PendingRun) -> None:
        if pending.begin():
            self._let_go(pending)
            pending.future.set_exception(RunForgottenError())

    def _let_go(self, pending: PendingRun, unsaved: Unsaved | None = None) -> None:
        with self._lock:
            if unsaved is not None:
                self._unsaved[pending.id] = unsaved
                while len(self._unsaved) > MAX_UNSAVED:
                    self._unsaved.popitem(last=False)
            del self._pending[pending.id]

    def _must_stop(self) -> bool:
        return self._closing.is_set() or self._is_ending()

    def prepare(self) -> None:
        """Waits until the kernel is loaded, or compiled at the very first start."""
        prepare_kernel()
        self._kernel_ready.set()


def _compact(result: RunResult) -> RunResult:
    """The run without the buffer of the kernel, which is larger than its rows."""
    trace = result.trace
    return replace(result, trace=Trace.from_rows(trace.shape, trace.to_rows()))
