"""Words on standard error for whoever waits longer than a second."""

from __future__ import annotations

import sys
import time
from threading import Lock, Timer
from types import TracebackType
from typing import Self

__all__ = ["COMPILING", "Progress"]

COMPILING = "compiling the simulation for this processor; only the first run waits, about 20 s"

PATIENCE = 1.0
REFRESH_PERIOD = 0.1


class Progress:
    """Tells what goes on: a line that moves in a terminal, one plain line elsewhere.

    Nothing is printed if it is over within a second.

    Args:
        text: What goes on.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._fraction: float | None = None
        self._announced = False
        self._next_refresh = 0.0
        self._lock = Lock()
        self._timer = Timer(PATIENCE, self.announce)
        self._timer.daemon = True

    def __enter__(self) -> Self:
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._timer.cancel()
        with self._lock:
            if self._announced and sys.stderr.isatty():
                print("\r\033[K", end="", file=sys.stderr, flush=True)
            self._announced = True

    def announce(self, text: str | None = None) -> None:
        """Prints the line now.

        Args:
            text: What goes on, if it is something else than at the start.
        """
        with self._lock:
            if text is not None:
                self._text = text
            elif self._announced:
                return
            self._announced = True
            self._print()

    def update(self, fraction: float) -> None:
        """Notes how much is done, 0 … 1."""
        with self._lock:
            self._fraction = fraction
            now = time.monotonic()
            if self._announced and sys.stderr.isatty() and now >= self._next_refresh:
                self._next_refresh = now + REFRESH_PERIOD
                self._print()

    def _print(self) -> None:
        done = "" if self._fraction is None else f": {self._fraction:.0%}"
        start, end = ("\r", "\033[K") if sys.stderr.isatty() else ("", "\n")
        print(f"{start}slipgrasp: {self._text}{done}", end=end, file=sys.stderr, flush=True)
