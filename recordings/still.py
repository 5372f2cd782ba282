"""Instant and size of a still image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from slipgrasp.core.exceptions import SlipgraspError

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult

LEAST_SIDE, MOST_SIDE = 240, 8192


class StillError(SlipgraspError, ValueError):
    """An invalid instant or size of a still image."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Still:
    """A still image of a run.

    Attributes:
        time: The instant [s]; the end of the run if None.
        width: Width of the image [px].
        height: Height of the image [px].
    """

    time: float | None = None
    width: int = 1280
    height: int = 720

    def __post_init__(self) -> None:
        for name, side in (("width", self.width), ("height", self.height)):
            if not LEAST_SIDE <= side <= MOST_SIDE:
                raise StillError(f"the {name} is {side} px; allowed: {LEAST_SIDE} … {MOST_SIDE}")
        if self.time is not None and not math.isfinite(self.time):
            raise StillError(f"the time is {self.time:g} s; it must be finite")

    def time_in(self, result: RunResult) -> float:
        """The instant in a run [s].

        Raises:
            StillError: If the run does not contain it.
        """
        first, last = float(result.trace.times[0]), result.end_time
        if self.time is None:
            return last
        if not first <= self.time <= last:
            raise StillError(
                f"the run has no instant {self.time:g} s; it lasts from {first:g} s to {last:g} s"
            )
        return self.time


AT_THE_END = Still()
"""The end of a run, in the default size."""
