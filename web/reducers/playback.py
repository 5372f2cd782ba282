"""The reducer of the play head."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    JumpToEvent,
    Seek,
    SetSpeed,
    ShowWindow,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.pacing import FramePacer
from slipgrasp.web.model.play_head import choice_after, moved
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer


class PlaybackReducer(Reducer):
    """Moves the play head: by hand, and with time while it plays.

    Args:
        pacer: Tells how often to draw.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        TogglePlay,
        Seek,
        Step,
        JumpToEvent,
        GoToEdge,
        SetSpeed,
        ChangeSpeed,
        ChooseWindow,
        ShowWindow,
        Zoom,
    )

    def __init__(self, pacer: FramePacer) -> None:
        self._pacer = pacer
        self._passed: float | None = None
        self._due = 0.0

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Moves the play head by hand."""
        if view.shown is None or view.playback is None:
            return view
        playback = moved(view.playback, intent, view.shown.result)
        if playback.playing and not view.playback.playing:
            self._passed = None  # Time that passed while it stood still does not move it.
        choice = choice_after(view.choice, intent, view.playback, playback)
        return replace(view, choice=choice, playback=playback)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Moves the play head on while it plays."""
        elapsed = now - self._passed if self._passed is not None else 0.0
        self._passed = now
        if view.playback is None or not view.playback.playing:
            return view
        if now >= self._due:
            interval = self._pacer.interval(now)
            # A frame that was a little late does not delay the next one.
            on_time = self._due + interval
            self._due = on_time if on_time > now else now + interval
        return replace(view, playback=view.playback.advance(elapsed))

    def wait(self, now: float, view: ViewState) -> float | None:
        """The next frame, while it plays."""
        if view.playback is None or not view.playback.playing or self._passed is None:
            return None
        return max(self._due - now, 0.0)
