"""A pace of playback: slow where something slips, fast in between."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase

_SECONDS_OF_A_SLIP, _SECONDS_BETWEEN, _MOST_SECONDS = 3.0, 1.0, 15.0
_BEFORE, _AFTER = 0.1, 0.25
"""How much of the time around a slip is as slow, as shares of its length."""
_SHORTEST_SLIP = 0.002
_JOINED = 0.02
"""Slips that are nearer than this share of the run are played as one."""
_EVENLY = 0.5


class Pace(NamedTuple):
    """Simulated seconds per second of the viewer's clock, constant in each piece of a run.

    Attributes:
        starts: Where each piece starts, ascending [s]; the first also counts before its start.
        speeds: The speed in each.
    """

    starts: tuple[float, ...]
    speeds: tuple[float, ...]

    def advance(self, time: float, elapsed: float, start: float, end: float) -> float:
        """The simulation time after some time; the end of a window wraps to its start.

        Args:
            time: Where it begins [s].
            elapsed: Time of the viewer's clock [s].
            start: Start of the window [s].
            end: Its end; not its start.
        """
        left = math.fmod(elapsed, self._duration(start, end))
        while True:
            until, speed = self._piece_at(time, end)
            if time + left * speed < until:
                return time + left * speed
            left -= (until - time) / speed
            time = until if until < end else start

    def _duration(self, start: float, end: float) -> float:
        """How long a window is played [s]."""
        duration, time = 0.0, start
        while time < end:
            until, speed = self._piece_at(time, end)
            duration, time = duration + (until - time) / speed, until
        return duration

    def _piece_at(self, time: float, end: float) -> tuple[float, float]:
        """Where the piece at a time ends, at the latest at an end, and its speed."""
        following = max(bisect_right(self.starts, time), 1)
        until = self.starts[following] if following < len(self.starts) else math.inf
        return min(until, end), self.speeds[following - 1]


def pace_of(result: RunResult) -> Pace:
    """The pace at which every slip takes some seconds, and what is in between one."""
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
    """Whether slips fill so much of a window that it can be played at one speed."""
    slips = _slips_of(result)
    inside = sum(max(min(b, end) - max(a, start), 0.0) for a, b in slips)
    return not slips or inside >= _EVENLY * (end - start)


def _slips_of(result: RunResult) -> list[tuple[float, float]]:
    """Ranges of time in which something slips, and a little around each, in order [s]."""
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
