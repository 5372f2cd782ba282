"""Which samples of a run are shown at the display rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

DISPLAY_RATE = 50.0
"""How often hand and object are shown unless asked otherwise [Hz]."""

_EARLY = 1e-6
"""Share of a tick by which a sample may be early: k / rate is rounded, and so is its time."""


class FrameClock:
    """Picks the first sample at or after each tick, at k / rate for whole k.

    A sample that is the first after several ticks is picked once. What is picked does not
    depend on how the samples come in blocks.

    Args:
        rate: Ticks per second [Hz].
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._ticks = 0

    def take(self, times: NDArray[np.float64]) -> NDArray[np.intp]:
        """The rows of the next block that are shown.

        Args:
            times: Times of the block's samples, none earlier than the one before it [s].

        Returns:
            Indices into the block, in order.
        """
        ticks = np.floor(times * self._rate + _EARLY).astype(np.int64) + 1
        rows = np.flatnonzero(np.diff(ticks, prepend=self._ticks) > 0)
        if len(ticks):
            self._ticks = int(ticks[-1])
        return rows
