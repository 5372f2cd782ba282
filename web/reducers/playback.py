"""Reducer of the play head."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.events import neighbouring_event_time, next_slip_time
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    GoToNextSlip,
    JumpToEvent,
    Seek,
    SetSpeed,
    ShowWindow,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.pace import pace_of
from slipgrasp.web.model.playback import (
    PACED,
    SPEEDS,
    Playback,
    TimeWindow,
    WindowChoice,
    marked_window,
    neighbouring_speed,
    neighbouring_time,
    speed_for,
    whole_window,
    window_of,
)
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.frame_pacing import FramePacer
from slipgrasp.web.reducers.reducer import Reducer


class PlaybackReducer(Reducer):
    """Moves the play head: by the user, and with time during playback.

    Args:
        pacer: Determines the frame rate.
        is_behind: Whether the last frame is still unsent. Another one would not be visible sooner,
            and would slow down sending.
    """

    def __init__(self, pacer: FramePacer, is_behind: Callable[[], bool] = lambda: False) -> None:
        self._pacer = pacer
        self._is_behind = is_behind
        self._passed: float | None = None
        self._due = 0.0

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Moves the play head as requested."""
        if view.shown is None or view.playback is None:
            return view
        playback = moved(view.playback, intent, view.shown.result)
        if playback.playing and not view.playback.playing:
            self._passed = None  # Time during a pause does not move it.
        choice = choice_after(view.choice, intent, view.playback, playback)
        if playback is view.playback and choice is view.choice:
            return view
        return replace(view, choice=choice, playback=playback)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Moves the play head during playback, whenever a frame is due."""
        if view.playback is None or not view.playback.playing:
            self._passed = now
            return view
        if self._passed is not None and now < self._due:
            return view
        interval = self._pacer.interval(now)
        # A slightly late frame does not delay the next one.
        on_time = self._due + interval
        self._due = on_time if on_time > now else now + interval
        if self._is_behind():
            return view
        elapsed = now - self._passed if self._passed is not None else 0.0
        self._passed = now
        return replace(view, playback=view.playback.advance(elapsed))

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time of the next frame during playback."""
        if view.playback is None or not view.playback.playing:
            return None
        return max(self._due - now, 0.0)


def moved(playback: Playback, intent: Intent, result: RunResult) -> Playback:
    """The play head after an intent; the same object if the intent does not concern it.

    Args:
        playback: The current play head.
        intent: The intent; times and names come from a browser.
        result: The run on the screen.
    """
    match intent:
        case TogglePlay():
            return replace(playback, playing=not playback.playing)
        case SetSpeed(name) if name == PACED:
            return replace(playback, pace=pace_of(result))
        case SetSpeed(name) if name in SPEEDS:
            return replace(playback, speed=SPEEDS[name], pace=None)
        case ChangeSpeed(direction):
            speed = neighbouring_speed(playback.speed, direction)
            return replace(playback, speed=speed, pace=None)
        case ChooseWindow() | ShowWindow() | Zoom():
            return _with_window(playback, intent, result)
        case _:
            return _put(playback, intent, result)


def choice_after(
    choice: WindowChoice, intent: Intent, before: Playback, after: Playback
) -> WindowChoice:
    """The choice of the time range after an intent.

    Args:
        choice: The current choice.
        intent: The intent.
        before: The previous play head.
        after: The new play head.
    """
    if isinstance(intent, ChooseWindow):
        return intent.choice
    return choice if after.window == before.window else WindowChoice.CLOSER


def _put(playback: Playback, intent: Intent, result: RunResult) -> Playback:
    """The play head at the time of an intent."""
    time: float | None = None
    match intent:
        case Seek(seconds) if math.isfinite(seconds):
            time = seconds
        case Step(direction):
            time = neighbouring_time(result.trace.times, playback.time, direction)
        case JumpToEvent(direction):
            time = neighbouring_event_time(result, playback.time, direction)
        case GoToNextSlip():
            time = next_slip_time(result, playback.time)
        case GoToEdge(direction):
            time = _edge_time(playback, direction, whole_window(result))
    return playback if time is None else playback.reach(time, whole_window(result))


def _edge_time(playback: Playback, direction: int, whole: TimeWindow) -> float:
    """An edge of the window [s]; if the play head is there, that edge of the run."""
    edges = [window.end if direction > 0 else window.start for window in (playback.window, whole)]
    return edges[playback.time == edges[0]]


def _with_window(
    playback: Playback, intent: ChooseWindow | ShowWindow | Zoom, result: RunResult
) -> Playback:
    """The play head in another time range of the run, with a suitable speed."""
    match intent:
        case ChooseWindow(choice):
            window = window_of(result, choice, playback.window)
        case ShowWindow(start, end) if math.isfinite(start) and math.isfinite(end):
            window = marked_window(result, start, end)
        case ShowWindow():
            return playback
        case Zoom():
            return playback.closer()
    return replace(playback.within(window), speed=speed_for(window))
