"""A clock that excludes the time in which this process is suspended."""

from __future__ import annotations

import time

LONGEST_GAP = 5.0
"""Largest interval between two readings that counts fully [s]."""


class AwakeClock:
    """A clock that starts at its creation and is read often.

    A suspension of the program (Ctrl-Z, a paused container, a sleeping computer) does not use up
    its limits: an interval between two readings counts as at most `LONGEST_GAP`.
    """

    def __init__(self) -> None:
        self._seconds = 0.0
        self._read_at = time.monotonic()

    def read(self) -> float:
        """The elapsed time [s]."""
        now = time.monotonic()
        self._seconds += min(now - self._read_at, LONGEST_GAP)
        self._read_at = now
        return self._seconds
