"""The queue of studies, the running study, and the shared workers."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.executors import Executor, make_executor
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.study_store import StudyStore
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.progress import LiveStudy, StudyState

IDLE_SECONDS = 300.0
_POLL = 0.1
UNEXPECTED = "an unexpected error; see the traceback in the server's log"

_logger = logging.getLogger(__name__)


class StudyQueue:
    """Runs one study after the other, in order of arrival.

    Args:
        store: Store of the studies.
        settings: Limits and executor.
        wait_for_recordings: Waits for some time, and returns whether studies may start.
    """

    def __init__(
        self,
        store: StudyStore,
        settings: Settings,
        wait_for_recordings: Callable[[float], bool] = lambda _seconds: True,
    ) -> None:
        self._store = store
        self._settings = settings
        self._wait_for_recordings = wait_for_recordings
        self._executor = WarmExecutor(
            partial(make_executor, settings.study_executor, workers=settings.study_workers)
        )
        self._lock = threading.Lock()
        self._studies: dict[str, LiveStudy] = {}
        self._worker: threading.Thread | None = None
        self._closing = threading.Event()

    def close(self) -> None:
        """Stops the running study without ending its file, and all workers."""
        self._closing.set()
        with self._lock:
            worker = self._worker
        if worker is not None:
            worker.join()
        self._executor.close()

    def find(self, study_id: str) -> LiveStudy | None:
        """A study that waits, runs or has failed; otherwise None."""
        with self._lock:
            return self._studies.get(study_id)

    def all(self) -> dict[str, LiveStudy]:
        """All studies by id."""
        with self._lock:
            return dict(self._studies)

    def check_capacity(self) -> None:
        """Checks whether another study may wait.

        Raises:
            ServiceBusyError: If the queue is full.
        """
        waiting = sum(live.is_waiting for live in self.all().values())
        if waiting >= self._settings.max_studies_waiting:
            busy_with = "studies are waiting already"
            raise ServiceBusyError(waiting, self._settings.retry_after, busy_with)

    def add(self, live: LiveStudy) -> None:
        """Queues a study, which starts after the previous ones."""
        with self._lock:
            self._studies[live.id] = live
        self._begin_next()

    def cancel(self, live: LiveStudy) -> None:
        """Ends a study soon; immediately if it is waiting or has failed."""
        live.cancel()
        if live.begin(StudyState.FAILED):
            self._end(live)

    def forget(self, study_id: str) -> None:
        """Removes a failed study that is deleted."""
        with self._lock:
            self._studies.pop(study_id, None)

    def _begin_next(self) -> None:
        with self._lock:
            if self._worker is not None or self._closing.is_set():
                return
            live = next((live for live in self._studies.values() if live.begin()), None)
            if live is not None:
                self._worker = threading.Thread(target=self._run, args=(live,), name="study")
                self._worker.start()

    def _run(self, live: LiveStudy) -> None:
        try:
            while not (self._closing.is_set() or live.is_cancelled):
                if self._wait_for_recordings(_POLL):
                    break
            self._end(live)
        finally:
            with self._lock:
                self._worker = None
            self._begin_next()

    def _end(self, live: LiveStudy) -> None:
        """Runs the rest of a study, and reports how it ended.

        A failed study can be resumed, now or by the next service.
        """
        state, message = StudyState.FAILED, UNEXPECTED
        try:
            end = self._schedule(live)
            if end is None:
                state, message = StudyState.QUEUED, ""
            else:
                live.stored = self._store.note_end(live.stored, end)
                state, message = StudyState(end.state), end.message
        except SlipgraspError as error:
            message = f"{error}; the study continues from here when it is resumed"
            _logger.error("study %s failed: %s", live.id, error)
        finally:
            live.end(state, message)
            if state is not StudyState.FAILED:
                self.forget(live.id)

    def _schedule(self, live: LiveStudy) -> StudyEnd | None:
        """Runs the rest of a study; None if it is left to the next service."""

        def should_stop() -> bool:
            return self._closing.is_set() or live.is_cancelled

        if (known := self._store.find_end(live.id)) is not None:
            return known
        with StudyWriter(self._store.path_of(live.id), live.study) as writer:
            if live.is_cancelled:
                end = _cancelled(writer)
            else:
                with self._executor.use() as executor:
                    end = schedule_runs(
                        live.study,
                        executor,
                        writer,
                        should_stop=should_stop,
                        watch=live.take,
                        keep=self._store.keeper_of(live.stored),
                    )
            if end.state == "cancelled" and not live.is_cancelled:
                return None
            writer.finish(end)
        if end.message:
            _logger.error("study %s: %s", live.id, end.message)
        return end


def _cancelled(writer: StudyWriter) -> StudyEnd:
    """The end of a study that was cancelled while waiting."""
    outcomes = dict(sorted(writer.outcomes.items()))
    return StudyEnd(state="cancelled", runs=writer.num_rows, outcomes=outcomes)


class WarmExecutor:
    """Keeps the workers of one study for the next.

    Args:
        make: Creates an executor.
        idle_seconds: Idle time after which its workers are stopped [s].
    """

    def __init__(self, make: Callable[[], Executor], idle_seconds: float = IDLE_SECONDS) -> None:
        self._make = make
        self._idle_seconds = idle_seconds
        self._lock = threading.Lock()
        self._executor: Executor | None = None
        self._in_use = False
        self._timer: threading.Timer | None = None

    @contextmanager
    def use(self) -> Iterator[Executor]:
        """An executor for one study at a time; after an error the next study gets a new one.

        Raises:
            ExecutorError: If the executor does not exist.
        """
        with self._lock:
            self._stop_timer()
            executor = self._executor = self._executor or self._make()
            self._in_use = True
        try:
            yield executor
        except BaseException:
            self.close()
            raise
        with self._lock:
            self._in_use = False
            self._timer = threading.Timer(self._idle_seconds, self._close_if_idle)
            self._timer.daemon = True
            self._timer.start()

    def close(self) -> None:
        """Stops the workers; they are restarted on demand."""
        with self._lock:
            self._stop_timer()
            self._drop()

    def _close_if_idle(self) -> None:
        with self._lock:
            if not self._in_use:
                self._drop()

    def _drop(self) -> None:
        executor, self._executor = self._executor, None
        self._in_use = False
        if executor is not None:
            executor.close()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
