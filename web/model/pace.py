"""Variable playback speed: slow during slip, fast in between."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase

_SECONDS_OF_A_SLIP, _SECONDS_BETWEEN, _MOST_SECONDS = 3.0, 1.0, 15.0
_BEFORE, _AFTER = 0.1, 0.25
"""Margin around a slip with slow playback, as fractions of its length."""
_SHORTEST_SLIP = 0.002
_JOINED = 0.02
"""Slips separated by less than this fraction of the run are merged."""
_EVENLY = 0.5


class Pace(NamedTuple):
    """Simulated seconds per second of the viewer's clock, piecewise constant.

    Attributes:
        starts: Start times in order [s]; the first also applies before its start.
        speeds: Speed of each segment.
    """

    starts: tuple[float, ...]
    speeds: tuple[float, ...]

    def advance(self, time: float, elapsed: float, start: float, end: float) -> float:
        """The simulation time after some elapsed time; the end of a window wraps to the start.

        Args:
            time: Initial time [s].
            elapsed: Time of the viewer's clock [s].
            start: Start of the window [s].
            end: End of the window, which is greater.
        """
        left = math.fmod(elapsed, self._duration(start, end))
        while True:
            until, speed = self._piece_at(time, end)
            if time + left * speed < until:
                return time + left * speed
            left -= (until - time) / speed
            time = until if until < end else start

    def _duration(self, start: float, end: float) -> float:
        """Playing time of a window [s]."""
        duration, time = 0.0, start
        while time < end:
            until, speed = self._piece_at(time, end)
            duration, time = duration + (until - time) / speed, until
        return duration

    def _piece_at(self, time: float, end: float) -> tuple[float, float]:
        """End of the segment at a time, at most a given end, and its speed."""
        following = max(bisect_right(self.starts, time), 1)
        until = self.starts[following] if following < len(self.starts) else math.inf
        return min(until, end), self.speeds[following - 1]


def pace_of(result: RunResult) -> Pace:
    """A pace with some seconds for every slip, and one second between slips."""
    slips = _slips_of(result)
    first, last = float(result.trace.times[0]), result.end_time
    seconds = min(_SECONDS_OF_A_SLIP, _MOST_SECONDS / max(len(slips), 1))
    starts, speeds, time = [], [], first
    for start, end in [*slips, (last, last)]:
        if start > time or not starts:
            starts.append(time)
            speeds.append(max(start - time, _SHORTEST_SLIP) / _SECONDS_BETWEEN)
        if end > start:
            starts.append(start)
            speeds.append((end - start) / seconds)
        time = end
    return Pace(tuple(starts), tuple(speeds))


def is_even(result: RunResult, start: float, end: float) -> bool:
    """Whether one speed suffices: without slip, or if slips fill most of a window."""
    slips = _slips_of(result)
    inside = sum(max(min(b, end) - max(a, start), 0.0) for a, b in slips)
    return not slips or inside >= _EVENLY * (end - start)


def _slips_of(result: RunResult) -> list[tuple[float, float]]:
    """Time ranges of slip with margins, in order [s]."""
    trace = result.trace
    slipping = np.concatenate([[0], (trace.phase != ContactPhase.STICK).any(axis=1), [0]])
    edges = np.flatnonzero(np.diff(slipping.astype(int)))
    found: list[tuple[float, float]] = []
    apart = _JOINED * (result.end_time - float(trace.times[0]))
    for begin, stop in edges.reshape(-1, 2).tolist():
        start, end = float(trace.times[begin]), float(trace.times[min(stop, len(trace) - 1)])
        length = max(end - start, _SHORTEST_SLIP)
        start = max(start - _BEFORE * length, float(trace.times[0]))
        end = min(end + _AFTER * length, result.end_time)
        if found and start - found[-1][1] < apart:
            start = found.pop()[0]
        if end > start:
            found.append((start, end))
    return found
