"""A fit that waits or runs, and its progress."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from slipgrasp.core.fit.problem import FitError
from slipgrasp.core.fit.progress import FitProgress
from slipgrasp.core.fit.report import FitReport
from slipgrasp.recordings.fit.fit_store import FitEnd, FitStore, StoredFit
from slipgrasp.recordings.fit.journal import FitStoppedError
from slipgrasp.recordings.fit.run_fit import run_fit
from slipgrasp.server.budget import MemoryBudget
from slipgrasp.server.fits.need import need_of
from slipgrasp.server.jobs.job import Job, ShouldStop, StudyState


@dataclass(frozen=True, slots=True, kw_only=True)
class FitStatus:
    """The progress of a fit.

    Attributes:
        stored: The fit in the store.
        state: Its state.
        progress: Its stage and its profiles so far.
        message: Reason why it has no report; empty otherwise.
    """

    stored: StoredFit
    state: StudyState
    progress: FitProgress
    message: str = ""

    @property
    def finished(self) -> int:
        """Number of its runs so far, without those of twins."""
        return self.progress.evaluations

    @classmethod
    def of(cls, stored: StoredFit, finding: str = "") -> Self:
        """Progress of a fit that is not in the queue: it has ended, or waits for another service.

        Args:
            stored: The fit in the store.
            finding: Reason why it cannot continue; empty if it can.
        """
        if stored.end is None:
            state = StudyState.FAILED if finding else StudyState.QUEUED
            return cls(stored=stored, state=state, progress=FitProgress(), message=finding)
        return cls(
            stored=stored,
            state=StudyState(stored.end.state),
            progress=FitProgress(evaluations=stored.end.evaluations),
            message=stored.end.message,
        )


class LiveFit(Job[FitStatus]):
    """A fit from its creation, or the service's start, to its end.

    Args:
        stored: The fit in the store.
        store: The store.
        memory: The memory budget.
    """

    def __init__(self, stored: StoredFit, store: FitStore, memory: MemoryBudget) -> None:
        super().__init__(stored.id)
        self.stored = stored
        self._store = store
        self._memory = memory
        self._progress = FitProgress()

    def status(self) -> FitStatus:
        """Progress of the fit."""
        with self._lock:
            return FitStatus(
                stored=self.stored,
                state=self._state,
                progress=self._progress,
                message=self._message,
            )

    def perform(self, should_stop: ShouldStop) -> FitEnd | None:
        """Runs the rest of the fit; for a cancelled fit, only the request is kept."""
        end = self._store.find_complete(self.id)
        if end is None and not self.is_cancelled:
            end = self._fit(should_stop)
        if end is None and not self.is_cancelled:
            return None
        end = end or FitEnd(state="cancelled", evaluations=self._progress.evaluations)
        self.stored = self._store.note_end(self.stored, end)
        return end

    def _fit(self, should_stop: ShouldStop) -> FitEnd | None:
        """Fits; None if it was stopped."""

        def must_stop() -> bool:
            self._store.runs.check_space()
            return should_stop()

        request, runs = self.stored.request, self._store.runs
        with self._memory.reserve(need_of(request, runs), give_up=should_stop):
            if should_stop():
                return None
            try:
                problem, options = request.read(runs)

                def write_page(report: FitReport) -> None:
                    # Deferred, because matplotlib takes a second to load.
                    from slipgrasp.figures.drawing_thread import in_drawing_thread
                    from slipgrasp.figures.fit_report import write_fit_page

                    page = self._store.page_path(self.id)
                    in_drawing_thread(lambda: write_fit_page(problem, report, page))

                report = run_fit(
                    problem,
                    self._store.study_path(self.id),
                    options,
                    overwrite=True,
                    watch=self._take,
                    should_stop=must_stop,
                    also_write=write_page,
                )
            except FitStoppedError:
                return None
            except FitError as error:
                evaluations = self._progress.evaluations
                return FitEnd(state="failed", evaluations=evaluations, message=str(error))
        return FitEnd(state="completed", evaluations=report.evaluations)

    def _take(self, progress: FitProgress) -> None:
        with self._lock:
            self._progress = progress
