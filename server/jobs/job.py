"""State of a study or fit that waits or runs; safe to use from several threads."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import StrEnum
from typing import Generic, Protocol, TypeVar

ShouldStop = Callable[[], bool]


class StudyState(StrEnum):
    """The state of a study, or of another job."""

    QUEUED = "queued"
    RUNNING = "running"
    COMPLETED = "completed"
    CANCELLED = "cancelled"
    FAILED = "failed"

    @property
    def has_ended(self) -> bool:
        """Whether the study has ended."""
        return self not in (StudyState.QUEUED, StudyState.RUNNING)


class JobStatus(Protocol):
    """The progress of a job."""

    @property
    def state(self) -> StudyState:
        """State of the job."""
        ...

    @property
    def finished(self) -> int:
        """Number of finished runs."""
        ...


StatusT = TypeVar("StatusT", bound=JobStatus)


class JobEnd(Protocol):
    """End of a job."""

    @property
    def state(self) -> str:
        """A value of `StudyState`."""
        ...

    @property
    def message(self) -> str:
        """The reason, if it is not complete."""
        ...


class Job(ABC, Generic[StatusT]):
    """A job from its creation, or the service's start, to its end.

    Args:
        job_id: Id of the job in the store.
    """

    def __init__(self, job_id: str) -> None:
        self.id = job_id
        self._lock = threading.Lock()
        self._state = StudyState.QUEUED
        self._message = ""
        self._cancelled = threading.Event()

    @property
    def is_cancelled(self) -> bool:
        """Whether cancellation was requested."""
        return self._cancelled.is_set()

    @property
    def is_waiting(self) -> bool:
        """Whether the job waits for its turn."""
        with self._lock:
            return self._state is StudyState.QUEUED

    @property
    def has_ended(self) -> bool:
        """Whether the job has ended."""
        with self._lock:
            return self._state.has_ended

    def cancel(self) -> None:
        """Requests cancellation."""
        self._cancelled.set()

    def begin(self, *also: StudyState) -> bool:
        """Starts the job; returns whether it was waiting or in one of the other given states."""
        with self._lock:
            its_turn = self._state in (StudyState.QUEUED, *also)
            if its_turn:
                self._state, self._message = StudyState.RUNNING, ""
            return its_turn

    def end(self, state: StudyState, message: str) -> None:
        """Sets the end of the job, or that it waits for another service.

        Args:
            state: Final state, or ``queued``.
            message: The reason, if the job is not complete.
        """
        with self._lock:
            self._state, self._message = state, message

    @abstractmethod
    def perform(self, should_stop: ShouldStop) -> JobEnd | None:
        """Runs the rest of the job; for a cancelled job, only stores its end.

        Args:
            should_stop: Called repeatedly; True leaves the rest to the next service, unless the
                job is cancelled.

        Returns:
            The end of the job; None if the rest is left to the next service.

        Raises:
            SlipgraspError: If the job failed and can be resumed.
        """

    @abstractmethod
    def status(self) -> StatusT:
        """Progress of the job."""
