"""The desk of the play head."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from web.desks.desk import Desk
from web.intents.intent import Intent
from web.intents.playback import ChooseWindow, Seek, SetSpeed, Step, TogglePlay, Zoom
from web.pacing import FRAME_INTERVAL
from web.play_head import moved
from web.playback import WindowChoice
from web.view import ViewState

__all__ = ["PlaybackDesk"]


class PlaybackDesk(Desk):
    """Moves the play head: by hand, and with time while it plays."""

    takes: ClassVar[tuple[type[Intent], ...]] = (
        TogglePlay,
        Seek,
        Step,
        SetSpeed,
        ChooseWindow,
        Zoom,
    )

    def __init__(self) -> None:
        self._passed: float | None = None

    def take(self, intent: Intent, view: ViewState) -> ViewState:
        """Moves the play head by hand."""
        if view.shown is None or view.playback is None:
            return view
        choice = view.choice
        if isinstance(intent, ChooseWindow):
            choice = intent.choice
        elif isinstance(intent, Zoom):
            choice = WindowChoice.CLOSER
        playback = moved(view.playback, intent, view.shown.result)
        return replace(view, choice=choice, playback=playback)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Moves the play head on while it plays."""
        elapsed = now - self._passed if self._passed is not None else 0.0
        self._passed = now
        if view.playback is None or not view.playback.playing:
            return view
        return replace(view, playback=view.playback.advance(elapsed))

    def wait(self, now: float, view: ViewState) -> float | None:
        """The next frame, while it plays."""
        if view.playback is None or not view.playback.playing or self._passed is None:
            return None
        return max(FRAME_INTERVAL - (now - self._passed), 0.0)
