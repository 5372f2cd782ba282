"""Deletes now and then what goes by the server's rules; knows no HTTP."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from datetime import UTC, datetime

from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.retention import Expired, Retention, delete_expired, find_expired
from slipgrasp.recordings.study.study_store import StudyStore

PERIOD = 3600.0
_POLL = 1.0

_logger = logging.getLogger(__name__)


class RetentionService:
    """Finds and deletes runs that may go.

    Args:
        runs: Where they are kept.
        studies: The studies whose recordings are among them.
        retention: What stays.
        wait_for_recordings: Waits for some time, and tells whether what a killed service left is
            recovered: only then it is known what there is.
        period: How long from one look to the next [s].
    """

    def __init__(
        self,
        runs: RecordingStore,
        studies: StudyStore,
        retention: Retention,
        wait_for_recordings: Callable[[float], bool],
        period: float = PERIOD,
    ) -> None:
        self.retention = retention
        self._runs = runs
        self._studies = studies
        self._wait_for_recordings = wait_for_recordings
        self._period = period
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Looks from now on, where there is a rule."""
        if not self.retention.keeps_all:
            self._thread = threading.Thread(target=self._work, name="retention")
            self._thread.start()

    def close(self) -> None:
        """Ends what goes on."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def expired(self, retention: Retention | None = None) -> list[Expired]:
        """The runs that would go, newest first.

        Args:
            retention: What would stay; the server's own rules if None.
        """
        rules = self.retention if retention is None else retention
        return find_expired(self._runs, self._studies, rules, datetime.now(UTC))

    def _work(self) -> None:
        while not (self._closing.is_set() or self._wait_for_recordings(_POLL)):
            pass
        pause = 0.0
        while not self._closing.wait(pause):
            self._delete()
            pause = self._period

    def _delete(self) -> None:
        try:
            gone = delete_expired(self._runs, self.expired())
        except RecordingError as error:
            _logger.error("runs that go by the retention rules are still there: %s", error)
            return
        if gone:
            size = sum(each.run.size for each in gone) / 1e6
            _logger.warning("deleted %d runs, %.2f MB, by the retention rules", len(gone), size)
