"""How long something takes, without the time in which this process stands still."""

from __future__ import annotations

import time

LONGEST_GAP = 5.0
"""What counts at most between two readings [s]."""


class AwakeClock:
    """Counts from the moment it is made, read often.

    A pause of the program (Ctrl-Z, a container or a computer that sleeps) does not use up its
    limits: a gap between two readings counts as `LONGEST_GAP` at most.
    """

    def __init__(self) -> None:
        self._seconds = 0.0
        self._read_at = time.monotonic()

    def read(self) -> float:
        """The time that has passed [s]."""
        now = time.monotonic()
        self._seconds += min(now - self._read_at, LONGEST_GAP)
        self._read_at = now
        return self._seconds
