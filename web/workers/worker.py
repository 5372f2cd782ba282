"""Worker threads of a session, so that its loop never waits for a disk or a simulation."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import NamedTuple

Task = Callable[[], None]

_logger = logging.getLogger(__name__)


class _Waiting(NamedTuple):
    """A task in the queue; mandatory tasks are run even when closing."""

    task: Task
    must: bool


class QueueWorker:
    """Runs tasks one after the other; of waiting tasks, only the latest of each subject.

    Its thread starts with the first task: most sessions never use most of their workers, and the
    stack of a thread needs memory.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self._wake = threading.Condition()
        self._waiting: dict[object, _Waiting] = {}
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._is_started = False

    def ask(self, task: Task, subject: object = None, *, must: bool = False) -> None:
        """Adds a task to the queue and returns immediately.

        Args:
            task: Function to call; it sends its results itself.
            subject: Subject of the task, which replaces a waiting task of the same subject; None
                to keep all.
            must: Whether the task is run even if the thread is closed first.
        """
        with self._wake:
            key = object() if subject is None else subject
            self._waiting.pop(key, None)
            self._waiting[key] = _Waiting(task, must)
            self._wake.notify()
            if not (self._is_started or self._closed):
                self._is_started = True
                self._thread.start()

    def close(self) -> None:
        """Ends the thread after the current and all mandatory tasks."""
        with self._wake:
            self._closed = True
            self._waiting = {key: w for key, w in self._waiting.items() if w.must}
            self._wake.notify()

    def is_closed(self) -> bool:
        """True after `close`."""
        return self._closed

    def join(self, timeout: float) -> None:
        """Waits for the thread to end, at most `timeout` [s]."""
        if self._is_started:
            self._thread.join(timeout)

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._closed or self._waiting)
                if not self._waiting:
                    return
                waiting = self._waiting.pop(next(iter(self._waiting)))
            try:
                waiting.task()
            except Exception:
                # Top level of the thread: a failed task must not prevent the following ones.
                _logger.exception("a task of the thread %s failed", self._thread.name)
            # Otherwise its runs would stay in memory until the next task.
            del waiting
