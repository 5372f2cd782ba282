"""A thread that runs the errands of one concern, so that its session never waits for a disk."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import NamedTuple

Errand = Callable[[], None]

_logger = logging.getLogger(__name__)


class _Waiting(NamedTuple):
    """An errand in the queue, and whether it is run in any case."""

    errand: Errand
    must: bool


class Errands:
    """Runs errands one after the other; of each subject only the latest that still waits.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self._wake = threading.Condition()
        self._waiting: dict[object, _Waiting] = {}
        self._closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def ask(self, errand: Errand, subject: object = None, *, must: bool = False) -> None:
        """Puts an errand in the queue, and returns at once.

        Args:
            errand: What to do; it tells its findings itself.
            subject: An errand of the same subject that still waits is forgotten; None if
                every one counts.
            must: Whether it is run even if the thread is to end first.
        """
        with self._wake:
            key = object() if subject is None else subject
            self._waiting.pop(key, None)
            self._waiting[key] = _Waiting(errand, must)
            self._wake.notify()

    def close(self) -> None:
        """Ends the thread once it has run what it is at, and what must be run."""
        with self._wake:
            self._closed = True
            self._waiting = {key: w for key, w in self._waiting.items() if w.must}
            self._wake.notify()

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
                waiting.errand()
            except Exception:
                # The edge of the thread: one failed errand must not end all that follow.
                _logger.exception("an errand of the thread %s failed", self._thread.name)
