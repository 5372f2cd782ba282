"""Progress and remaining time of compiling the simulation."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from slipgrasp.core.run.simulator import kernel_progress

COMPILING_SECONDS = 45.0
"""Approximate compilation time on an idle processor [s]."""

_LEAST_USED = 0.5
_SECONDS_TOLD = 90.0
"""Longer times are shown in minutes [s]."""


class Preparation:
    """Reports the progress of compilation at the first start; thread-safe.

    The remaining time depends on other load, so it is estimated from the progress since the first
    query: by the number of compiled units, or before the first unit by the processor time of this
    process.

    Args:
        share_ready: Returns the compiled fraction of the simulation, 0 to 1.
        clock: Returns the time [s].
        processor_time: Returns the processor time of this process [s].
    """

    def __init__(
        self,
        share_ready: Callable[[], float] = kernel_progress,
        clock: Callable[[], float] = time.monotonic,
        processor_time: Callable[[], float] = time.process_time,
    ) -> None:
        self._share_ready = share_ready
        self._clock = clock
        self._processor_time = processor_time
        self._lock = threading.Lock()
        self._first: tuple[float, float, float] | None = None

    def look(self) -> tuple[float, float | None]:
        """The compiled fraction, 0 to 1, and the remaining time [s], None while unknown."""
        share, now, used = self._share_ready(), self._clock(), self._processor_time()
        with self._lock:
            if share >= 1.0:
                self._first = None
                return 1.0, 0.0
            if self._first is None:
                self._first = now, used, share
            began, used_before, before = self._first
        passed, used, done = now - began, used - used_before, share - before
        if done > 0.0:
            return share, passed * (1.0 - share) / done
        if _LEAST_USED < used < COMPILING_SECONDS:
            return share, passed * (COMPILING_SECONDS - used) / used
        return share, None

    def words(self) -> str:
        """The progress and remaining time as text; empty when everything is compiled."""
        share, seconds = self.look()
        return f"{share:.0%} done, {time_to_go(seconds)}" if share < 1.0 else ""


def time_to_go(seconds: float | None) -> str:
    """The remaining time of a compilation as text.

    Args:
        seconds: The remaining time [s], None while unknown.
    """
    if seconds is None:
        return "half a minute or more to go, longer on a busy machine"
    told = f"{seconds:.0f} s" if seconds < _SECONDS_TOLD else f"{seconds / 60.0:.0f} min"
    return f"about {told} to go"
