"""How fast the frames of one viewer are read; what comes faster waits at its sender."""

from __future__ import annotations

import time
from collections.abc import Callable

FRAMES_PER_SECOND = 100.0
BYTES_PER_SECOND = 8 << 20
BURST_SECONDS = 2.0


class Pace:
    """Counts the frames of one viewer against what may be read in the time.

    A page sends at most some fifty frames a second, but all at once what the line held back. To
    close a viewer that floods costs more than to read it slowly: all that it has sent by then
    would still have to be taken in.

    Args:
        clock: Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._counted_at = clock()
        self._frames_left = FRAMES_PER_SECOND * BURST_SECONDS
        self._bytes_left = BYTES_PER_SECOND * BURST_SECONDS

    def count(self, num_bytes: int) -> float:
        """Counts a frame.

        Args:
            num_bytes: Its length.

        Returns:
            How long to wait before the next is read [s].
        """
        now = self._clock()
        passed, self._counted_at = now - self._counted_at, now
        self._frames_left = _refill(self._frames_left, passed, FRAMES_PER_SECOND) - 1.0
        self._bytes_left = _refill(self._bytes_left, passed, BYTES_PER_SECOND) - num_bytes
        owed = -self._frames_left / FRAMES_PER_SECOND, -self._bytes_left / BYTES_PER_SECOND
        return max(0.0, *owed)


def _refill(left: float, passed: float, rate: float) -> float:
    return min(left + rate * passed, rate * BURST_SECONDS)
