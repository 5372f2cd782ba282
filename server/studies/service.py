"""Runs studies one after the other, and reads their results; independent of HTTP.

Finished runs are written to the file of the study at once. If the service ends, or is killed, the
next service continues after the last row.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from functools import partial

from slipgrasp.core.processors import available_processors
from slipgrasp.core.study.checks import find_warnings
from slipgrasp.core.study.cost import StudyCost, estimate_cost
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import check_members
from slipgrasp.recordings.exceptions import StorageFullError
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.results import StudyResults, read_results
from slipgrasp.recordings.study.study_store import StoredStudy, StudyStore
from slipgrasp.server.addresses import study_path
from slipgrasp.server.jobs.queue import JobQueue
from slipgrasp.server.jobs.service import JobService
from slipgrasp.server.request_keys import UNKEYED, KeyedRequest
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.progress import LiveStudy, StudyStatus
from slipgrasp.server.studies.recorder import StudyRecorder
from slipgrasp.server.studies.runner import StudyRunner

MAX_OPENED = 4
MAX_OPENED_ROWS = 1_000_000
"""Number of ended studies in memory, and the total number of their runs."""


class StudyService(JobService[StoredStudy, StudyStatus]):
    """Accepts studies, runs one at a time, and returns their results.

    Args:
        store: The store of studies.
        settings: The limits.
        queue: Runs studies in turn; its own if None.
        is_ending: Whether the service is about to end, so that long work stops.
    """

    noun = "study"
    path_of = study_path
    live_type = LiveStudy
    ended_status = StudyStatus.of

    def __init__(
        self,
        store: StudyStore,
        settings: Settings,
        queue: JobQueue | None = None,
        is_ending: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(store, queue or JobQueue(settings), settings, is_ending)
        self.store = store
        self._runner = StudyRunner(store, settings)
        self._recorder = StudyRecorder(store, is_ending)
        self._opening = threading.Lock()
        self._opened: OrderedDict[str, StudyResults] = OrderedDict()

    def close(self) -> None:
        """Leaves unfinished studies to the next service, and ends all workers."""
        self._queue.close()
        self._runner.close()

    def estimate(self, study: Study) -> tuple[StudyCost, tuple[str, ...]]:
        """The estimated cost of a study, and reasons why it may fail."""
        settings = self._settings
        cost = estimate_cost(study, settings.study_workers or available_processors())
        warnings = [*find_warnings(study)]
        if study.num_runs > settings.max_study_runs:
            warnings.append(
                f"the study has {study.num_runs} runs; at most {settings.max_study_runs} are "
                "allowed on this server"
            )
        try:
            settings.storage_limits.check(settings.data_directory, cost.bytes)
        except StorageFullError as error:
            warnings.append(f"the disk may not hold the whole study: {error}")
        return cost, tuple(warnings)

    def create(
        self, make_study: Callable[[], Study], request: KeyedRequest = UNKEYED
    ) -> StudyStatus:
        """Accepts a study, or finds the study that the same request has already created.

        Args:
            make_study: Returns the study, or raises its errors.
            request: The request.

        Raises:
            ScenarioError: If the study, or one of its runs, is not valid.
            IdempotencyKeyReusedError: If another request had this key.
            ServiceBusyError: If too many studies are waiting, or being checked.
            ServiceEndingError: If the service ends before every run is checked.
            RecordingWriteError: If nothing can be saved.
        """

        def check() -> tuple[Study, StudyCost, tuple[str, ...]]:
            study = make_study()
            check_members(study, self._refuse_when_ending)
            return study, *self.estimate(study)

        return self._accept(request, check, partial(self._store_new, request))

    def _store_new(
        self, request: KeyedRequest, checked: tuple[Study, StudyCost, tuple[str, ...]]
    ) -> LiveStudy:
        study, cost, warnings = checked
        stored = self.store.create(
            study, idempotency_key=request.key, request_digest=request.digest
        )
        return LiveStudy(stored, StudyResults(study), self._runner, cost, warnings)

    def results(self, study_id: str) -> StudyResults:
        """The rows of a study, which grow as long as it runs.

        Raises:
            StudyNotFoundError: If it does not exist.
            RecordingError: If its file is damaged.
        """
        live = self._find_live(study_id)
        if isinstance(live, LiveStudy):
            return live.results
        # Two requests at once would read the file twice.
        with self._opening:
            self.store.get(study_id)
            results = self._opened.pop(study_id, None)
            if results is None:
                results = read_results(self.store.file_of(study_id))
            self._opened[study_id] = results
            while len(self._opened) > 1 and self._has_too_many():
                self._opened.popitem(last=False)
            return results

    def _has_too_many(self) -> bool:
        rows = sum(results.num_rows for results in self._opened.values())
        return len(self._opened) > MAX_OPENED or rows > MAX_OPENED_ROWS

    def delete(self, job_id: str) -> None:
        """Deletes a study permanently; recordings of its runs are kept."""
        super().delete(job_id)
        with self._opening:
            self._opened.pop(job_id, None)

    def record_run(self, study_id: str, index: int) -> tuple[StoredRun, bool]:
        """The recording of a run, and whether it was created now; see `StudyRecorder.record`."""
        results = self.results(study_id)
        return self._recorder.record(self.status(study_id).stored, results, index)

    def _continued(self, stored: StoredStudy) -> LiveStudy:
        # The file may have rows whose writing was not confirmed.
        return LiveStudy(stored, read_results(self.store.file_of(stored.id)), self._runner)
