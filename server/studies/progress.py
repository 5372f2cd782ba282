"""The progress of a study that waits or runs; safe to use from several threads."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Self

from slipgrasp.core.study.cost import StudyCost
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.study_store import StoredStudy
from slipgrasp.server.jobs.job import Job, ShouldStop, StudyState

RATE_WINDOW = 10.0
MARK_EVERY = 0.25


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
        message: Reason for an early end; empty otherwise.
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
            finding: Reason why it cannot continue; empty if it can.
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


class LiveStudy(Job[StudyStatus]):
    """A study from its creation, or the service's start, to its end.

    Args:
        stored: The study in the store.
        results: Its rows so far.
        run: Runs the rest of the study.
        cost: Its estimated cost; None if unknown.
        warnings: Warnings about it.
    """

    def __init__(
        self,
        stored: StoredStudy,
        results: StudyResults,
        run: Callable[[LiveStudy, ShouldStop], StudyEnd | None],
        cost: StudyCost | None = None,
        warnings: tuple[str, ...] = (),
    ) -> None:
        super().__init__(stored.id)
        self.stored = stored
        self.study = results.study
        self.results = results
        self._run = run
        self._cost = cost
        self._warnings = warnings
        self._outcomes = Counter(results.summary().outcomes)
        self._finished = results.num_rows
        self._pace = _Pace()

    def perform(self, should_stop: ShouldStop) -> StudyEnd | None:
        """Runs the rest of the study; finished runs are kept."""
        return self._run(self, should_stop)

    def take(self, row: StudyRow) -> None:
        """Adds a finished run; they come in order."""
        self.results.append(row)
        now = time.monotonic()
        with self._lock:
            self._pace.note(now, self._finished)
            self._finished += 1
            self._outcomes[row.outcome.value] += 1

    def status(self) -> StudyStatus:
        """Progress of the study."""
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
