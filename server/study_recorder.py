"""Makes a row of a study's results a recording, checked against what the study computed."""

from __future__ import annotations

import threading

from core.types import Outcome
from recordings.stored_run import StoredRun
from recordings.study.member import MemberResult, record_member
from recordings.study.rebuild import rebuild
from recordings.study.results import StudyResults
from recordings.study.rows import StudyRow
from recordings.study.study_store import StoredStudy, StudyStore
from server.errors import ResultNotFoundError, ServiceBusyError

__all__ = ["StudyRecorder"]

MAX_AT_ONCE = 2


class StudyRecorder:
    """Simulates runs of studies again, a few at a time, and keeps their recordings.

    Args:
        store: Where they are kept.
        retry_after: When to come back if it is busy [s].
    """

    def __init__(self, store: StudyStore, retry_after: int) -> None:
        self._store = store
        self._retry_after = retry_after
        self._places = threading.BoundedSemaphore(MAX_AT_ONCE)

    def record(
        self, stored: StoredStudy, results: StudyResults, index: int
    ) -> tuple[StoredRun, bool]:
        """The recording of a run, made if it is not kept already.

        Args:
            stored: The study.
            results: Its results.
            index: The run.

        Returns:
            The run, and whether it was made now.

        Raises:
            ResultNotFoundError: If there is no result of it.
            RebuildError: If it does not come out as its row says.
            ServiceBusyError: If others are being made.
            RecordingWriteError: If it cannot be written.
        """
        if not 0 <= index < results.num_rows:
            raise ResultNotFoundError(stored.id, index, results.num_rows, stored.num_runs)
        if (kept := self._store.find_recording(stored, index)) is not None:
            return kept, False
        if not self._places.acquire(blocking=False):
            busy_with = "runs are being recorded already"
            raise ServiceBusyError(MAX_AT_ONCE, self._retry_after, busy_with)
        try:
            row = _row(results, index)
            recording = record_member(rebuild(results.study, row))
            made = MemberResult(row=row, recording=recording)
            return self._store.save_recording(stored, made), True
        finally:
            self._places.release()


def _row(results: StudyResults, index: int) -> StudyRow:
    """What a run is rebuilt from: its values and its hash."""
    told = results.row(index)
    return StudyRow(
        index=index,
        values=results.study.values_of(index),
        outcome=Outcome(told["outcome"]),
        reason=None,
        end_time=told["end_time"],
        metrics={},
        state_hash=told["state_hash"] or "",
        kernel=told["kernel"] or "",
    )
