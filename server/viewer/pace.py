"""Rate limit of the frames from one viewer; faster frames wait at the sender."""

from __future__ import annotations

import time
from collections.abc import Callable

FRAMES_PER_SECOND = 100.0
BYTES_PER_SECOND = 8 << 20
BURST_SECONDS = 2.0


class Pace:
    """Compares the frames of one viewer with the allowed rate.

    A page sends at most about fifty frames a second, but delayed frames arrive together. Closing a
    flooding viewer costs more than reading it slowly, because everything that it has sent by then
    would still have to be received.

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
            num_bytes: Size of the frame.

        Returns:
            Delay before the next frame is read [s].
        """
        now = self._clock()
        passed, self._counted_at = now - self._counted_at, now
        self._frames_left = _refill(self._frames_left, passed, FRAMES_PER_SECOND) - 1.0
        self._bytes_left = _refill(self._bytes_left, passed, BYTES_PER_SECOND) - num_bytes
        owed = -self._frames_left / FRAMES_PER_SECOND, -self._bytes_left / BYTES_PER_SECOND
        return max(0.0, *owed)


def _refill(left: float, passed: float, rate: float) -> float:
    return min(left + rate * passed, rate * BURST_SECONDS)
