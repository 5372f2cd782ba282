"""The threads of a session, so that its loop never waits for a disk or a simulation."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

Task = Callable[[], None]

_logger = logging.getLogger(__name__)


class Worker(ABC):
    """A thread that works for a session, and answers with intents."""

    @abstractmethod
    def close(self) -> None:
        """Asks it to end; what is to be kept is still kept."""

    @abstractmethod
    def join(self, timeout: float) -> None:
        """Waits until it has ended [s]."""


class _Waiting(NamedTuple):
    """A task in the queue, and whether it is run in any case."""

    task: Task
    must: bool


class QueueWorker(Worker):
    """Runs tasks one after the other; of each subject only the latest that still waits.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self._wake = threading.Condition()
        self._waiting: dict[object, _Waiting] = {}
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def ask(self, task: Task, subject: object = None, *, must: bool = False) -> None:
        """Puts a task in the queue, and returns at once.

        Args:
            task: The function to call; it reports its findings itself.
            subject: A task of the same subject that still waits is forgotten; None if
                every one counts.
            must: Whether it is run even if the thread is to end first.
        """
        with self._wake:
            key = object() if subject is None else subject
            self._waiting.pop(key, None)
            self._waiting[key] = _Waiting(task, must)
            self._wake.notify()

    def close(self) -> None:
        """Ends the thread once it has run what it is at, and what must be run."""
        with self._wake:
            self._closed = True
            self._waiting = {key: w for key, w in self._waiting.items() if w.must}
            self._wake.notify()

    def is_closed(self) -> bool:
        """Whether it was asked to end."""
        return self._closed

    def join(self, timeout: float) -> None:
        """Waits until the thread has ended [s]."""
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
                # The edge of the thread: one failed task must not end all that follow.
                _logger.exception("a task of the thread %s failed", self._thread.name)
            # Until the next one comes it would keep the runs that it was about.
            del waiting
