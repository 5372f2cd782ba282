"""Runs studies with workers that stay warm from one to the next."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from slipgrasp.core.executors import Executor, make_executor
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.study_store import StudyStore
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.server.jobs.job import ShouldStop
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.progress import LiveStudy

IDLE_SECONDS = 300.0

_logger = logging.getLogger(__name__)


class StudyRunner:
    """Runs the rest of a study.

    Args:
        store: Store of the studies.
        settings: Who simulates.
    """

    def __init__(self, store: StudyStore, settings: Settings) -> None:
        self._store = store
        self._executor = WarmExecutor(
            partial(make_executor, settings.study_executor, workers=settings.study_workers)
        )

    def close(self) -> None:
        """Ends all workers."""
        self._executor.close()

    def __call__(self, live: LiveStudy, should_stop: ShouldStop) -> StudyEnd | None:
        """Runs the rest of a study; None if it is left to the next service."""
        end = self._schedule(live, should_stop)
        if end is not None:
            live.stored = self._store.note_end(live.stored, end)
        return end

    def _schedule(self, live: LiveStudy, should_stop: ShouldStop) -> StudyEnd | None:
        if (known := self._store.find_end(live.id)) is not None:
            return known
        with StudyWriter(self._store.path_of(live.id), live.study) as writer:
            if live.is_cancelled:
                end = writer.ending()
            else:
                with self._executor.use() as executor:
                    end = schedule_runs(
                        live.study,
                        executor,
                        writer,
                        should_stop=should_stop,
                        watch=live.take,
                        keep=self._store.keeper_of(live.stored),
                    )
            if end.state == "cancelled" and not live.is_cancelled:
                return None
            writer.finish(end)
        if end.message:
            _logger.error("study %s: %s", live.id, end.message)
        return end


class WarmExecutor:
    """Keeps the workers of one study for the next.

    Args:
        make: Makes an executor.
        idle_seconds: Idle time after which its workers are stopped [s].
    """

    def __init__(self, make: Callable[[], Executor], idle_seconds: float = IDLE_SECONDS) -> None:
        self._make = make
        self._idle_seconds = idle_seconds
        self._lock = threading.Lock()
        self._executor: Executor | None = None
        self._in_use = False
        self._timer: threading.Timer | None = None

    @contextmanager
    def use(self) -> Iterator[Executor]:
        """An executor for one study at a time; after an error the next study gets a new one.

        Raises:
            ExecutorError: If the executor does not exist.
        """
        with self._lock:
            self._stop_timer()
            executor = self._executor = self._executor or self._make()
            self._in_use = True
        try:
            yield executor
        except BaseException:
            self.close()
            raise
        with self._lock:
            self._in_use = False
            self._timer = threading.Timer(self._idle_seconds, self._close_if_idle)
            self._timer.daemon = True
            self._timer.start()

    def close(self) -> None:
        """Stops the workers; they are restarted on demand."""
        with self._lock:
            self._stop_timer()
            self._drop()

    def _close_if_idle(self) -> None:
        with self._lock:
            if not self._in_use:
                self._drop()

    def _drop(self) -> None:
        executor, self._executor = self._executor, None
        self._in_use = False
        if executor is not None:
            executor.close()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
