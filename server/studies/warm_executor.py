"""Workers that are started when they are needed, and ended when they have been idle."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from slipgrasp.core.executors import Executor

IDLE_SECONDS = 300.0


class WarmExecutor:
    """Keeps the workers of one study for the next.

    Args:
        make: Makes an executor.
        idle_seconds: After how long without work its workers are ended [s].
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
        """An executor, for one study at a time; after an error the next one gets another.

        Raises:
            ExecutorError: If there is none of that name.
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
        """Ends the workers; they are started again when they are needed."""
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
