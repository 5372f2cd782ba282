"""State and movement of the play head; plain values without a viewer."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.model.pace import Pace, is_even, pace_of

SPEEDS: dict[str, float] = {
    **{f"1/{parts}": 1 / parts for parts in (1000, 512, 256, 128, 64, 32, 16, 8, 4, 2)},
    **{f"{times}": float(times) for times in (1, 2, 4)},
}

PACED = "slips slow"
"""Name of the variable speed, slow during slip and fast in between."""

_SHORTEST_WINDOW = 0.002
_SHARE_AFTER_SLIP = 0.35
_SHARE_BEFORE_SLIP = 0.1
SECONDS_PER_PASS = 6.0
_FIRST_PICTURE = 0.4
_ZOOM = 4.0
_SHORTEST_ZOOM = 1e-3


class WindowChoice(StrEnum):
    """Choice of the time range to play and chart."""

    SLIP = "slip"
    WHOLE = "whole run"
    CLOSER = "closer"


@dataclass(frozen=True, slots=True)
class TimeWindow:
    """A range of simulation time [s]."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """Its length [s]."""
        return self.end - self.start

    def clamp(self, time: float) -> float:
        """The time in the window closest to ``time`` [s]."""
        return min(max(time, self.start), self.end)


@dataclass(frozen=True, slots=True, kw_only=True)
class Playback:
    """The play head, which moves through a window repeatedly.

    Attributes:
        time: Simulation time shown [s].
        window: Time range to play and chart.
        speed: Simulated seconds per second of the viewer's clock.
        playing: Whether it moves.
        pace: Variable speed; None for one speed.
    """

    time: float
    window: TimeWindow
    speed: float
    playing: bool
    pace: Pace | None = None

    def advance(self, elapsed: float) -> Playback:
        """The play head after some time of the viewer's clock; the end wraps to the start.

        Args:
            elapsed: Time since the last call [s].
        """
        if not self.playing or self.window.length <= 0.0:
            return self
        if self.pace is not None:
            start, end = self.window.start, self.window.end
            return replace(self, time=self.pace.advance(self.time, elapsed, start, end))
        into = self.time + elapsed * self.speed - self.window.start
        if into > self.window.length:
            into = math.fmod(into, self.window.length)
        return replace(self, time=self.window.start + into)

    def seek(self, time: float) -> Playback:
        """The play head moved by the user, paused."""
        return replace(self, time=self.window.clamp(time), playing=False)

    def closer(self) -> Playback:
        """The play head in a shorter window around it, with a suitable speed."""
        length = max(self.window.length / _ZOOM, _SHORTEST_ZOOM)
        start = self.window.clamp(self.time - 0.5 * length)
        window = TimeWindow(start, self.window.clamp(start + length))
        return replace(self.within(window), speed=speed_for(window))

    def reach(self, time: float, whole: TimeWindow) -> Playback:
        """The play head moved to a time of the run, paused; its window follows if necessary.

        Args:
            time: Simulation time [s]; moved into the run if outside.
            whole: The whole run.
        """
        time = whole.clamp(time)
        if self.window.start <= time <= self.window.end:
            return self.seek(time)
        length = self.window.length
        start = max(min(time - 0.5 * length, whole.end - length), whole.start)
        return replace(self, window=TimeWindow(start, whole.clamp(start + length))).seek(time)

    def within(self, window: TimeWindow) -> Playback:
        """The play head in another window, moved into it if it was outside."""
        return replace(self, window=window, time=window.clamp(self.time))


def start_playback(result: RunResult) -> Playback:
    """Plays the slip of a run slowly, from its middle, so that the first image shows it.

    Separate slips each play slowly, starting before the first.
    """
    window = slip_window(result)
    pace = None if is_even(result, window.start, window.end) else pace_of(result)
    share = _FIRST_PICTURE if pace is None else 0.0
    time = window.start + share * window.length
    return Playback(time=time, window=window, speed=speed_for(window), playing=True, pace=pace)


def window_of(result: RunResult, choice: WindowChoice, present: TimeWindow) -> TimeWindow:
    """The time range of a run for a choice.

    Args:
        result: The run.
        choice: The choice.
        present: The current time range; a close-up stays there as far as possible.
    """
    whole = whole_window(result)
    if choice is WindowChoice.SLIP:
        return slip_window(result)
    kept = TimeWindow(whole.clamp(present.start), whole.clamp(present.end))
    return kept if choice is WindowChoice.CLOSER and kept.length > 0.0 else whole


def whole_window(result: RunResult) -> TimeWindow:
    """The run from its start to its end."""
    return TimeWindow(float(result.trace.times[0]), result.end_time)


def slip_window(result: RunResult) -> TimeWindow:
    """The time range of slip in a run and of pushes that begin in it, with margins around it.

    Args:
        result: A run; without slip the whole run is returned.
    """
    trace, whole = result.trace, whole_window(result)
    slipping = np.flatnonzero((trace.phase != ContactPhase.STICK).any(axis=1))
    if len(slipping) == 0:
        return whole
    first = float(trace.times[slipping[0]])
    last = float(trace.times[min(slipping[-1] + 1, len(trace) - 1)])
    length = max((last - first) * (1.0 + _SHARE_AFTER_SLIP), _SHORTEST_WINDOW)
    pushes = [p for p in result.scenario.pulses if first <= p.time <= first + length]
    ends = [(p.time + p.duration - first) * (1.0 + _SHARE_AFTER_SLIP) for p in pushes]
    length = max(length, *ends, 0.0)
    start = whole.clamp(first - _SHARE_BEFORE_SLIP * length)
    return TimeWindow(start, whole.clamp(first + _round_up(length)))


def speed_for(window: TimeWindow) -> float:
    """The available speed at which a window takes about six seconds."""
    wanted = max(window.length, 1e-9) / SECONDS_PER_PASS
    return min(SPEEDS.values(), key=lambda speed: abs(math.log(speed / wanted)))


def marked_window(result: RunResult, start: float, end: float) -> TimeWindow:
    """The time range between two times in any order, at least a millisecond long.

    Args:
        result: The run.
        start: One time [s]; moved into the run if outside.
        end: The other [s].
    """
    whole = whole_window(result)
    first, last = sorted((whole.clamp(start), whole.clamp(end)))
    last = whole.clamp(max(last, first + _SHORTEST_ZOOM))
    return TimeWindow(whole.clamp(min(first, last - _SHORTEST_ZOOM)), last)


def neighbouring_speed(speed: float, direction: int) -> float:
    """The next faster (1) or slower (-1) available speed."""
    speeds = list(SPEEDS.values())
    place = speeds.index(speed) + direction
    return speeds[min(max(place, 0), len(speeds) - 1)]


def neighbouring_time(times: NDArray[np.float64], time: float, direction: int) -> float:
    """The next (1) or the previous (-1) of sorted times, at most the last or the first [s]."""
    side: Literal["left", "right"] = "right" if direction > 0 else "left"
    place = int(np.searchsorted(times, time, side=side)) - (direction < 0)
    return float(times[min(max(place, 0), len(times) - 1)])


def _round_up(time: float) -> float:
    """The next duration with two significant digits [s]."""
    if time <= 0.0:
        return time
    step = 10.0 ** (math.floor(math.log10(time)) - 1)
    return math.ceil(time / step - 1e-9) * step
