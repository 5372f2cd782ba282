"""The progress of a study that waits or runs; safe to use from several threads."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Self

from slipgrasp.core.study.cost import StudyCost
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.study_store import StoredStudy

RATE_WINDOW = 10.0
MARK_EVERY = 0.25


class StudyState(StrEnum):
    """The state of a study."""

    QUEUED = "queued"
    RUNNING = "running"
    COMPLETED = "completed"
    CANCELLED = "cancelled"
    FAILED = "failed"

    @property
    def has_ended(self) -> bool:
        """Whether the study has ended."""
        return self not in (StudyState.QUEUED, StudyState.RUNNING)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyStatus:
    """The progress of a study.

    Attributes:
        stored: The study in the store.
        state: Its state.
        finished: Number of finished runs.
        outcomes: Number of finished runs by outcome.
        rate: Recent number of runs per second; None unless it is running [1/s].
        time_left: Estimated remaining time; None if unknown [s].
        estimate: Its estimated cost; None once it has ended.
        message: Why it ended before it was complete; empty otherwise.
        warnings: Warnings at its creation.
    """

    stored: StoredStudy
    state: StudyState
    finished: int
    outcomes: dict[str, int]
    rate: float | None = None
    time_left: float | None = None
    estimate: StudyCost | None = None
    message: str = ""
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, stored: StoredStudy, finding: str = "") -> Self:
        """The progress of a study that is not queued: it has ended, or waits for another service.

        Args:
            stored: The study in the store.
            finding: Why it cannot continue; empty if it can.
        """
        if stored.end is None:
            state = StudyState.FAILED if finding else StudyState.QUEUED
            return cls(stored=stored, state=state, finished=0, outcomes={}, message=finding)
        return cls(
            stored=stored,
            state=StudyState(stored.end.state),
            finished=stored.end.runs,
            outcomes=dict(stored.end.outcomes),
            message=stored.end.message,
        )


@dataclass(slots=True)
class _Pace:
    """The number of runs per second, from counts of the last seconds."""

    marks: deque[tuple[float, int]] = field(default_factory=deque)

    def note(self, now: float, count: int) -> None:
        if self.marks and now - self.marks[-1][0] < MARK_EVERY:
            return
        self.marks.append((now, count))
        while now - self.marks[0][0] > RATE_WINDOW:
            self.marks.popleft()

    def rate(self, now: float, count: int) -> float | None:
        if not self.marks or count <= self.marks[0][1]:
            return None
        then, before = self.marks[0]
        return (count - before) / max(now - then, 1e-3)


class LiveStudy:
    """A study from its creation, or the service's start, to its end.

    Args:
        stored: The study in the store.
        results: Its rows so far.
        cost: Its estimated cost; None if unknown.
        warnings: Warnings about it.
    """

    def __init__(
        self,
        stored: StoredStudy,
        results: StudyResults,
        cost: StudyCost | None = None,
        warnings: tuple[str, ...] = (),
    ) -> None:
        self.stored = stored
        self.study = results.study
        self.results = results
        self._cost = cost
        self._warnings = warnings
        self._lock = threading.Lock()
        self._state = StudyState.QUEUED
        self._outcomes = Counter(results.summary().outcomes)
        self._finished = results.num_rows
        self._message = ""
        self._pace = _Pace()
        self._cancelled = threading.Event()

    @property
    def id(self) -> str:
        """Its id in the store."""
        return self.stored.id

    @property
    def is_cancelled(self) -> bool:
        """Whether its end was requested."""
        return self._cancelled.is_set()

    @property
    def is_waiting(self) -> bool:
        """Whether it waits for its turn."""
        with self._lock:
            return self._state is StudyState.QUEUED

    @property
    def has_ended(self) -> bool:
        """Whether the study has ended."""
        with self._lock:
            return self._state.has_ended

    def cancel(self) -> None:
        """Requests its end; finished runs are kept."""
        self._cancelled.set()

    def begin(self, *also: StudyState) -> bool:
        """Starts it, and returns whether it was waiting, or in one of the other given states."""
        with self._lock:
            its_turn = self._state in (StudyState.QUEUED, *also)
            if its_turn:
                self._state, self._message = StudyState.RUNNING, ""
            return its_turn

    def take(self, row: StudyRow) -> None:
        """Adds a finished run; they come in order."""
        self.results.append(row)
        now = time.monotonic()
        with self._lock:
            self._pace.note(now, self._finished)
            self._finished += 1
            self._outcomes[row.outcome.value] += 1

    def end(self, state: StudyState, message: str) -> None:
        """Sets how it ended, or that it waits for another service.

        Args:
            state: How it ended.
            message: The reason, if it is not complete.
        """
        with self._lock:
            self._state, self._message = state, message

    def status(self) -> StudyStatus:
        """Its progress."""
        now = time.monotonic()
        with self._lock:
            running = self._state is StudyState.RUNNING
            rate = self._pace.rate(now, self._finished) if running else None
            return StudyStatus(
                stored=self.stored,
                state=self._state,
                finished=self._finished,
                outcomes=dict(self._outcomes),
                rate=rate,
                time_left=self._time_left(rate),
                estimate=None if self._state.has_ended else self._cost,
                message=self._message,
                warnings=self._warnings,
            )

    def _time_left(self, rate: float | None) -> float | None:
        left = self.study.num_runs - self._finished
        if self._state.has_ended:
            return None
        if rate is not None:
            return left / rate
        return None if self._cost is None else self._cost.seconds * left / self.study.num_runs
