"""Queue of waiting jobs, of which one runs at a time."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.jobs.job import Job, StudyState
from slipgrasp.server.settings import Settings

_POLL = 0.1
UNEXPECTED = "an unexpected error; the server's log has its traceback"

_logger = logging.getLogger(__name__)


class JobQueue:
    """Runs jobs one after the other, in order of arrival.

    Args:
        settings: Settings, with the largest number of waiting jobs.
        wait_for_recordings: Waits for some time, and returns whether jobs may start.
    """

    def __init__(
        self,
        settings: Settings,
        wait_for_recordings: Callable[[float], bool] = lambda _seconds: True,
    ) -> None:
        self._settings = settings
        self._wait_for_recordings = wait_for_recordings
        self._lock = threading.Lock()
        self._jobs: dict[str, Job[Any]] = {}
        self._worker: threading.Thread | None = None
        self._closing = threading.Event()

    def close(self) -> None:
        """Interrupts the running job without storing an end, so that it can be continued."""
        self._closing.set()
        with self._lock:
            worker = self._worker
        if worker is not None:
            worker.join()

    def all(self) -> dict[str, Job[Any]]:
        """Waiting, running and failed jobs, by id."""
        with self._lock:
            return dict(self._jobs)

    def num_before(self, job_id: str) -> int:
        """Number of jobs queued before a waiting job."""
        ids = [job.id for job in self.all().values() if not job.has_ended]
        return ids.index(job_id) if job_id in ids else 0

    def check_capacity(self) -> None:
        """Checks that another job can be queued.

        Raises:
            ServiceBusyError: If the queue is full.
        """
        waiting = sum(job.is_waiting for job in self.all().values())
        if waiting >= self._settings.max_studies_waiting:
            raise ServiceBusyError(f"{waiting} studies or fits are waiting already")

    def add(self, job: Job[Any]) -> None:
        """Adds a job, which starts when all earlier jobs have ended."""
        with self._lock:
            self._jobs[job.id] = job
        self._begin_next()

    def cancel(self, job: Job[Any]) -> None:
        """Cancels a job; immediately if it is waiting or has failed."""
        job.cancel()
        if job.begin(StudyState.FAILED):
            self._end(job)

    def forget(self, job_id: str) -> None:
        """Removes a failed job that is deleted."""
        with self._lock:
            self._jobs.pop(job_id, None)

    def _begin_next(self) -> None:
        with self._lock:
            if self._worker is not None or self._closing.is_set():
                return
            job = next((job for job in self._jobs.values() if job.begin()), None)
            if job is not None:
                self._worker = threading.Thread(target=self._run, args=(job,), name="job")
                self._worker.start()

    def _run(self, job: Job[Any]) -> None:
        try:
            while not (self._closing.is_set() or job.is_cancelled):
                if self._wait_for_recordings(_POLL):
                    break
            self._end(job)
        finally:
            with self._lock:
                self._worker = None
            self._begin_next()

    def _end(self, job: Job[Any]) -> None:
        """Runs the rest of a job, and sets its end.

        A failed job is not changed, so that it can be resumed, or continued by the next service.
        """

        def should_stop() -> bool:
            return self._closing.is_set() or job.is_cancelled

        state, message, is_kept = StudyState.FAILED, UNEXPECTED, True
        try:
            end = job.perform(should_stop)
            is_kept = False
            if end is None:
                state, message = StudyState.QUEUED, ""
            else:
                state, message = StudyState(end.state), end.message
        except SlipgraspError as error:
            message = f"{error}; it continues from here when it is resumed"
            _logger.error("job %s failed: %s", job.id, error)
        finally:
            job.end(state, message)
            if not is_kept:
                self.forget(job.id)
