"""Creates recordings of study results, and verifies them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from slipgrasp.core.executors import Cancelled
from slipgrasp.core.trace.types import Outcome, Reason
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.rebuild import rebuild
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.study_store import StoredStudy, StudyStore
from slipgrasp.recordings.study.task import StudyRun, encode_recording
from slipgrasp.server.exceptions import ResultNotFoundError, ServiceBusyError, ServiceEndingError

MAX_AT_ONCE = 2
WALL_LIMIT = 120.0
"""Limit of elapsed time of one run [s], longer than in a study, for slower machines."""


class StudyRecorder:
    """Simulates runs of studies again, a few at a time, and stores their recordings.

    Args:
        store: Store of the recordings.
        is_ending: Whether the service is about to end.
    """

    def __init__(self, store: StudyStore, is_ending: Callable[[], bool]) -> None:
        self._store = store
        self._is_ending = is_ending
        self._making: set[tuple[str, int]] = set()
        self._lock = threading.Lock()

    def record(
        self, stored: StoredStudy, results: StudyResults, index: int
    ) -> tuple[StoredRun, bool]:
        """The recording of a run, created if it does not exist.

        Args:
            stored: The study.
            results: Its results.
            index: Index of the run.

        Returns:
            The run, and whether it was created now.

        Raises:
            ResultNotFoundError: If the run has no result.
            RebuildError: If the run differs from its result.
            ServiceBusyError: If other recordings, or this one, are being created.
            ServiceEndingError: If the service ends first.
            RecordingWriteError: If a file cannot be written.
        """
        if not 0 <= index < results.num_rows:
            raise ResultNotFoundError(stored.id, index, results.num_rows, stored.num_runs)
        if (kept := self._store.find_recording(stored, index)) is not None:
            return kept, False
        with self._place_for(stored.id, index):
            if (kept := self._store.find_recording(stored, index)) is not None:
                return kept, False
            made = self._make(results, _row(results, index))
            return self._store.save_recording(stored, made), True

    @contextmanager
    def _place_for(self, study_id: str, index: int) -> Iterator[None]:
        one = (study_id, index)
        with self._lock:
            if one in self._making:
                raise ServiceBusyError("the recording of this run is already being created")
            if len(self._making) >= MAX_AT_ONCE:
                raise ServiceBusyError(f"{MAX_AT_ONCE} runs are already being recorded")
            self._making.add(one)
        try:
            yield
        finally:
            with self._lock:
                self._making.remove(one)

    def _make(self, results: StudyResults, row: StudyRow) -> StudyRun:
        try:
            result = rebuild(results.study, row, should_stop=self._is_ending, wall_limit=WALL_LIMIT)
        except Cancelled as error:
            raise ServiceEndingError from error
        return StudyRun(row=row, recording=encode_recording(result))


def _row(results: StudyResults, index: int) -> StudyRow:
    """Data for rebuilding a run: its values, its reason, and its hash."""
    told = results.row(index)
    return StudyRow(
        index=index,
        values=results.study.values_of(index),
        outcome=Outcome(told["outcome"]),
        reason=_reason(told),
        end_time=told["end_time"],
        metrics={},
        state_hash=told["state_hash"] or "",
        kernel=told["kernel"] or "",
    )


def _reason(told: dict[str, Any]) -> Reason | None:
    if told["reason"] is None:
        return None
    return Reason(
        code=told["reason"],
        message=told["reason_message"],
        contact=None,
        time=told["end_time"],
        value=None,
        limit=None,
        hint="",
    )
