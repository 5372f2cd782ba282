"""Runs studies one after the other, and reads their results; independent of HTTP.

Finished runs are written to the file of the study at once. If the service ends, or is killed, the
next service continues after the last row.
"""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable

from slipgrasp.core.processors import available_processors
from slipgrasp.core.study.checks import find_warnings
from slipgrasp.core.study.cost import StudyCost, estimate_cost
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import check_members
from slipgrasp.recordings.exceptions import RecordingError, StorageFullError
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.results import StudyResults, read_results
from slipgrasp.recordings.study.study_store import StoredStudy, StudyStore
from slipgrasp.server.exceptions import (
    IdempotencyKeyReusedError,
    ServiceBusyError,
    ServiceEndingError,
    StudyEndedError,
    StudyUnfinishedError,
)
from slipgrasp.server.request_keys import UNKEYED, KeyedRequest
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.progress import LiveStudy, StudyState, StudyStatus
from slipgrasp.server.studies.queue import StudyQueue
from slipgrasp.server.studies.recorder import StudyRecorder

MAX_CHECKS = 4
MAX_OPENED = 4
MAX_OPENED_ROWS = 1_000_000
"""Number of ended studies in memory, and the total number of their runs."""

_logger = logging.getLogger(__name__)


class StudyService:
    """Accepts studies, runs one at a time, and returns their results.

    Args:
        store: The store of studies.
        settings: The limits.
        is_ending: Whether the service is about to end, so that long work stops.
        wait_for_recordings: Waits for some time, and returns whether all recordings that a killed
            service left are recovered: a study may write one of them again.
    """

    def __init__(
        self,
        store: StudyStore,
        settings: Settings,
        is_ending: Callable[[], bool] = lambda: False,
        wait_for_recordings: Callable[[float], bool] = lambda _seconds: True,
    ) -> None:
        self.store = store
        self._settings = settings
        self._is_ending = is_ending
        self._queue = StudyQueue(store, settings, wait_for_recordings)
        self._recorder = StudyRecorder(store, settings.retry_after, is_ending)
        self._creating = threading.Lock()
        self._opening = threading.Lock()
        self._checks = threading.BoundedSemaphore(MAX_CHECKS)
        self._opened: OrderedDict[str, StudyResults] = OrderedDict()
        self._broken: dict[str, str] = {}
        self._restored = threading.Event()

    def start(self) -> None:
        """Continues studies of an earlier service, if no other service can be running them."""
        if self._settings.exclusive:
            threading.Thread(target=self._restore, name="studies", daemon=True).start()
        else:
            self._restored.set()

    def close(self) -> None:
        """Leaves unfinished studies to the next service."""
        self._queue.close()

    @property
    def num_unfinished(self) -> int:
        """The number of studies that wait or run."""
        return sum(not live.has_ended for live in self._queue.all().values())

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
        """Accepts a study, or finds the one that the same request has created before.

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
        self._restored.wait()
        if (known := self._find_made(request)) is not None:
            return known
        study, cost, warnings = self._checked(make_study)
        with self._creating:
            if (known := self._find_made(request)) is not None:
                return known
            self._queue.check_capacity()
            stored = self.store.create(
                study, idempotency_key=request.key, request_digest=request.digest
            )
            live = LiveStudy(stored, StudyResults(study), cost, warnings)
            self._queue.add(live)
        return live.status()

    def status(self, study_id: str) -> StudyStatus:
        """The progress of a study.

        Raises:
            StudyNotFoundError: If it does not exist.
        """
        live = self.find_live(study_id)
        return live.status() if live is not None else self._status_of(self.store.get(study_id))

    def find_live(self, study_id: str) -> LiveStudy | None:
        """A study that waits, runs, or has failed; None otherwise."""
        self._restored.wait()
        return self._queue.find(study_id)

    def list(self, offset: int, limit: int) -> tuple[list[StudyStatus], int]:
        """The studies, newest first, and their number.

        Args:
            offset: Number of the newest studies to skip.
            limit: Largest number of studies.
        """
        self._restored.wait()
        # In this order: a study that ends meanwhile is reported by its runner.
        live = self._queue.all()
        stored, count = self.store.list(offset, limit)
        statuses = [
            live[study.id].status() if study.id in live else self._status_of(study)
            for study in stored
        ]
        return statuses, count

    def results(self, study_id: str) -> StudyResults:
        """The rows of a study, which grow as long as it runs.

        Raises:
            StudyNotFoundError: If it does not exist.
            RecordingError: If its file is damaged.
        """
        live = self.find_live(study_id)
        if live is not None:
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

    def cancel(self, study_id: str) -> StudyStatus:
        """Ends a study; finished runs are kept, and ended studies are not changed.

        Raises:
            StudyNotFoundError: If it does not exist.
        """
        live = self.find_live(study_id)
        if live is None:
            return self.status(study_id)
        self._queue.cancel(live)
        return live.status()

    def resume(self, study_id: str) -> StudyStatus:
        """Continues a study that has failed, after its last row.

        Waiting and running studies are not changed.

        Raises:
            StudyNotFoundError: If it does not exist.
            StudyEndedError: If it has ended otherwise.
            ServiceBusyError: If too many studies are waiting.
            RecordingError: If its file is damaged.
        """
        with self._creating:
            status = self.status(study_id)
            if not status.state.has_ended:
                return status
            if status.state is not StudyState.FAILED:
                raise StudyEndedError(study_id, status.state)
            self._queue.check_capacity()
            # The file may have rows whose writing was not confirmed.
            live = LiveStudy(status.stored, read_results(self.store.file_of(study_id)))
            self._broken.pop(study_id, None)
            self._queue.add(live)
            return live.status()

    def delete(self, study_id: str) -> None:
        """Deletes a study permanently; recordings of its runs are kept.

        Raises:
            StudyNotFoundError: If it does not exist.
            StudyUnfinishedError: If it has not ended.
        """
        live = self.find_live(study_id)
        if live is not None and not live.has_ended:
            raise StudyUnfinishedError(study_id)
        self.store.delete(study_id)
        self._queue.forget(study_id)
        with self._opening:
            self._opened.pop(study_id, None)

    def record_run(self, study_id: str, index: int) -> tuple[StoredRun, bool]:
        """The recording of a run, and whether it was created now; see `StudyRecorder.record`."""
        results = self.results(study_id)
        return self._recorder.record(self.status(study_id).stored, results, index)

    def _status_of(self, stored: StoredStudy) -> StudyStatus:
        return StudyStatus.of(stored, stored.finding or self._broken.get(stored.id, ""))

    def _refuse_when_ending(self, share: float) -> None:
        """Called repeatedly during long work, with the completed fraction."""
        if self._is_ending():
            raise ServiceEndingError

    def _find_made(self, request: KeyedRequest) -> StudyStatus | None:
        stored = self.store.find_by_key(request.key) if request.key else None
        if stored is None:
            return None
        if stored.request_digest != request.digest:
            raise IdempotencyKeyReusedError(f"study '{stored.id}'")
        return self.status(stored.id)

    def _checked(self, make_study: Callable[[], Study]) -> tuple[Study, StudyCost, tuple[str, ...]]:
        if not self._checks.acquire(blocking=False):
            busy_with = "studies are being checked already"
            raise ServiceBusyError(MAX_CHECKS, self._settings.retry_after, busy_with)
        try:
            study = make_study()
            check_members(study, self._refuse_when_ending)
            return study, *self.estimate(study)
        finally:
            self._checks.release()

    def _restore(self) -> None:
        try:
            for stored in self.store.unfinished():
                try:
                    results = read_results(self.store.file_of(stored.id))
                except RecordingError as error:
                    _logger.error("study %s cannot continue: %s", stored.id, error)
                    self._broken[stored.id] = f"it cannot continue: {error}"
                else:
                    self._queue.add(LiveStudy(stored, results))
        finally:
            self._restored.set()
