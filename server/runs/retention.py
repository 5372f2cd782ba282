"""Regularly deletes runs by the server's retention rules; independent of HTTP."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Collection
from datetime import timedelta

from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.retention import (
    Retention,
    TrustedClock,
    delete_expired,
    find_expired,
    in_share,
)
from slipgrasp.recordings.study.study_store import StudyStore

PERIOD = 3600.0
_POLL = 1.0

_logger = logging.getLogger(__name__)


class RetentionService:
    """Deletes runs by the retention rules.

    Args:
        runs: Store of the runs.
        studies: Store of the studies of these recordings.
        retention: Retention rules.
        wait_for_recordings: Waits for some time, and returns whether the runs of a killed service
            are recovered, so that all runs are known.
        find_used: Returns the ids of runs that stay, since a fit needs them.
        clock: Reference time of ages; the trusted wall clock if None.
    """

    def __init__(
        self,
        runs: RecordingStore,
        studies: StudyStore,
        retention: Retention,
        wait_for_recordings: Callable[[float], bool],
        find_used: Callable[[], Collection[str]],
        clock: TrustedClock | None = None,
    ) -> None:
        self._retention = retention
        self._runs = runs
        self._studies = studies
        self._wait_for_recordings = wait_for_recordings
        self._find_used = find_used
        self._clock = clock or TrustedClock(runs)
        self._is_first_look = True
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Starts regular checks, if there is a rule."""
        if not self._retention.keeps_all:
            self._thread = threading.Thread(target=self._work, name="retention")
            self._thread.start()

    def close(self) -> None:
        """Stops the checks."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        self._tell_doubts()
        while not (self._closing.is_set() or self._wait_for_recordings(_POLL)):
            pass
        pause = 0.0
        while not self._closing.wait(pause):
            self._delete()
            pause = PERIOD

    def _tell_doubts(self) -> None:
        """Logs that the wall clock is not trusted, before deletions that depend on it."""
        lag = self._clock.lag()
        if self._retention.max_age is not None and lag > timedelta():
            _logger.warning(
                "the clock is %d days further ahead of the newest run than is trusted: ages of "
                "runs are counted from %s; set the clock if it is wrong",
                lag.days,
                self._clock.now().isoformat(timespec="seconds"),
            )

    def _delete(self) -> None:
        try:
            used = self._find_used()
            now = self._clock.now()
            due = find_expired(self._runs, self._studies, self._retention, now, used)
            at_once = in_share(due, self._runs.count(), at_start=self._is_first_look)
            gone = delete_expired(self._runs, at_once)
        except RecordingError as error:
            _logger.error("runs could not be deleted by the retention rules: %s", error)
            return
        self._is_first_look = False
        if gone:
            size = sum(each.run.size for each in gone) / 1e6
            _logger.warning(
                "deleted %d runs, %.2f MB, by the retention rules; %d more will be deleted later",
                len(gone),
                size,
                len(due) - len(at_once),
            )
