"""Accepts jobs of one kind, runs one at a time, and finds them again; independent of HTTP.

The next service continues jobs that were interrupted because the service ended or was killed.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Generic, TypeVar

from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.store.job_store import JobStore, StoredJob
from slipgrasp.server.exceptions import (
    IdempotencyKeyReusedError,
    JobEndedError,
    JobUnfinishedError,
    ServiceBusyError,
    ServiceEndingError,
)
from slipgrasp.server.jobs.job import Job, StatusT, StudyState
from slipgrasp.server.jobs.queue import JobQueue
from slipgrasp.server.request_keys import KeyedRequest
from slipgrasp.server.settings import Settings

MAX_CHECKS = 4

_logger = logging.getLogger(__name__)


StoredT = TypeVar("StoredT", bound=StoredJob)
CheckedT = TypeVar("CheckedT")


class JobService(ABC, Generic[StoredT, StatusT]):
    """Accepts jobs of one kind, and runs them in a queue that it may share with others.

    Args:
        store: Store of the jobs.
        queue: Queue that runs them.
        settings: The limits.
        is_ending: Whether the service is about to end, so that long work stops.

    Attributes:
        noun: Name of the kind.
        path_of: Returns the path of a job.
        live_type: Type of jobs in the queue.
        ended_status: Returns the progress of a job that is not in the queue, from the job, and the
            reason why it cannot continue: empty if it can, or has ended.
    """

    noun: ClassVar[str]
    path_of: ClassVar[Callable[[str], str]]
    live_type: ClassVar[type[Job[Any]]]
    ended_status: ClassVar[Callable[[Any, str], Any]]

    def __init__(
        self,
        store: JobStore[StoredT],
        queue: JobQueue,
        settings: Settings,
        is_ending: Callable[[], bool],
    ) -> None:
        self._jobs = store
        self._queue = queue
        self._settings = settings
        self._is_ending = is_ending
        self._creating = threading.Lock()
        self._checks = threading.BoundedSemaphore(MAX_CHECKS)
        self._broken: dict[str, str] = {}
        self._restored = threading.Event()

    @abstractmethod
    def _continued(self, stored: StoredT) -> Job[StatusT]:
        """Prepares a job of an earlier service, or a failed one, to be continued.

        Raises:
            RecordingError: If its file is damaged.
        """

    def start(self) -> None:
        """Continues jobs of an earlier service, if no other service can be running them."""
        if self._settings.exclusive:
            threading.Thread(target=self._restore, name=self.noun, daemon=True).start()
        else:
            self._restored.set()

    @property
    def num_unfinished(self) -> int:
        """The number of jobs that wait or run."""
        return sum(not live.has_ended for live in self._all_live().values())

    def status(self, job_id: str) -> StatusT:
        """The progress of a job.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        live = self._find_live(job_id)
        return self._status_of(self._jobs.get(job_id)) if live is None else live.status()

    def list(self, offset: int, limit: int) -> tuple[list[StatusT], int]:
        """The jobs, newest first, and their number.

        Args:
            offset: Number of the newest jobs to skip.
            limit: Largest number of jobs.
        """
        self._restored.wait()
        # In this order, so that a job that ends between the calls is in both.
        live = self._all_live()
        stored, count = self._jobs.list(offset, limit)
        statuses = [
            live[job.id].status() if job.id in live else self._status_of(job) for job in stored
        ]
        return statuses, count

    def num_before(self, job_id: str) -> int:
        """Number of jobs of any kind queued before a waiting job."""
        return self._queue.num_before(job_id)

    def cancel(self, job_id: str) -> StatusT:
        """Ends a job; ended jobs are not changed.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        live = self._find_live(job_id)
        if live is None:
            return self.status(job_id)
        self._queue.cancel(live)
        return live.status()

    def resume(self, job_id: str) -> StatusT:
        """Continues a failed job from its last state.

        Waiting and running jobs are not changed.

        Raises:
            RecordingNotFoundError: If it does not exist.
            JobEndedError: If it has ended otherwise.
            ServiceBusyError: If too many jobs are waiting.
            RecordingError: If its file is damaged.
        """
        with self._creating:
            status = self.status(job_id)
            if not status.state.has_ended:
                return status
            if status.state is not StudyState.FAILED:
                raise JobEndedError(self.noun, job_id, status.state)
            self._queue.check_capacity()
            live = self._continued(self._jobs.get(job_id))
            self._broken.pop(job_id, None)
            self._queue.add(live)
            return live.status()

    def delete(self, job_id: str) -> None:
        """Deletes a job permanently.

        Raises:
            RecordingNotFoundError: If it does not exist.
            JobUnfinishedError: If it has not ended.
        """
        live = self._find_live(job_id)
        if live is not None and not live.has_ended:
            raise JobUnfinishedError(self.noun, job_id, type(self).path_of(job_id))
        self._jobs.delete(job_id)
        self._queue.forget(job_id)

    def _accept(
        self,
        request: KeyedRequest,
        check: Callable[[], CheckedT],
        make: Callable[[CheckedT], Job[StatusT]],
    ) -> StatusT:
        """Accepts a job, or finds the job that the same request has already created.

        Args:
            request: The request.
            check: Checks the request.
            make: Stores the job.

        Raises:
            IdempotencyKeyReusedError: If another request had this key.
            ServiceBusyError: If too many jobs are waiting, or being checked.
        """
        self._restored.wait()
        if (known := self._find_made(request)) is not None:
            return known
        checked = self._checked(check)
        with self._creating:
            if (known := self._find_made(request)) is not None:
                return known
            self._queue.check_capacity()
            live = make(checked)
            self._queue.add(live)
        return live.status()

    def _all_live(self) -> dict[str, Job[StatusT]]:
        found = self._queue.all()
        return {key: job for key, job in found.items() if isinstance(job, self.live_type)}

    def _find_live(self, job_id: str) -> Job[StatusT] | None:
        self._restored.wait()
        return self._all_live().get(job_id)

    def _status_of(self, stored: StoredT) -> StatusT:
        return type(self).ended_status(stored, stored.finding or self._broken.get(stored.id, ""))

    def _refuse_when_ending(self, share: float) -> None:
        """Called repeatedly during long work, with the completed fraction."""
        if self._is_ending():
            raise ServiceEndingError

    def _find_made(self, request: KeyedRequest) -> StatusT | None:
        stored = self._jobs.find_by_key(request.key) if request.key else None
        if stored is None:
            return None
        if stored.request_digest != request.digest:
            raise IdempotencyKeyReusedError(f"{self.noun} '{stored.id}'")
        return self.status(stored.id)

    def _checked(self, check: Callable[[], CheckedT]) -> CheckedT:
        if not self._checks.acquire(blocking=False):
            raise ServiceBusyError(f"{MAX_CHECKS} requests of this kind are being checked already")
        try:
            return check()
        finally:
            self._checks.release()

    def _restore(self) -> None:
        try:
            for stored in self._jobs.unfinished():
                try:
                    live = self._continued(stored)
                except RecordingError as error:
                    _logger.error("%s %s cannot continue: %s", self.noun, stored.id, error)
                    self._broken[stored.id] = f"it cannot continue: {error}"
                else:
                    self._queue.add(live)
        finally:
            self._restored.set()
