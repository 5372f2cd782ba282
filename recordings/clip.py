"""The time range, the speed and the size of an animation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from slipgrasp.core.exceptions import SlipgraspError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from slipgrasp.core.run.result import RunResult

SLOWEST, FASTEST = 1e-4, 100.0
LEAST_HEIGHT, MOST_HEIGHT = 240, 2160


class ClipError(SlipgraspError, ValueError):
    """An invalid time range, speed or height of an animation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clip:
    """The time range, speed and size of an animation.

    Attributes:
        start: Start of the animation [s]; the start of the run if None.
        end: End of the animation [s]; the end of the run if None.
        speed: Simulated seconds per second of the viewer's clock.
        height: Height of the image [px]; the default of the format if None.
    """

    start: float | None = None
    end: float | None = None
    speed: float = 1.0
    height: int | None = None

    def __post_init__(self) -> None:
        if not SLOWEST <= self.speed <= FASTEST:
            raise ClipError(f"the speed is {self.speed:g}; allowed: {SLOWEST:g} … {FASTEST:g}")
        if self.height is not None and not LEAST_HEIGHT <= self.height <= MOST_HEIGHT:
            raise ClipError(
                f"the height is {self.height} px; allowed: {LEAST_HEIGHT} … {MOST_HEIGHT}"
            )

    def span(self, result: RunResult) -> tuple[float, float]:
        """Start and end in a run [s].

        Raises:
            ClipError: If the range is outside the run.
        """
        first, last = float(result.trace.times[0]), result.end_time
        start = first if self.start is None else max(self.start, first)
        end = last if self.end is None else min(self.end, last)
        whole = self.start is None and self.end is None
        if not (start < end or whole):
            raise ClipError(
                f"the clip from {start:g} s to {end:g} s is empty; the run lasts from {first:g} s "
                f"to {last:g} s"
            )
        return start, end

    def times(self, result: RunResult, fps: float, most: int) -> NDArray[np.float64]:
        """Evenly spaced times of frames, from its start to its end [s].

        Args:
            result: The run.
            fps: Frames per second of the viewer's clock; fewer if there would be too many.
            most: Largest number of frames.
        """
        # Help texts import the table of formats without NumPy.
        import numpy as np

        start, end = self.span(result)
        wanted = math.ceil((end - start) / self.speed * fps) + 1
        return np.linspace(start, end, min(max(wanted, 2), most))

    def clock(self, time: float) -> str:
        """Formats a time precisely enough to differ between frames."""
        return f"t = {time:.2f} s" if self.speed >= 0.5 else f"t = {1e3 * time:.2f} ms"


WHOLE = Clip()
"""The whole run in real time."""
