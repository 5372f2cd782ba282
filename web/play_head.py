"""What an intent makes of the play head; plain values, no viewer."""

from __future__ import annotations

import math
from dataclasses import replace

from core.result import RunResult
from web.intents.intent import Intent
from web.intents.playback import ChooseWindow, Seek, SetSpeed, Step, TogglePlay, Zoom
from web.playback import SPEEDS, Playback, neighbouring_time, speed_for, window_of

__all__ = ["moved"]


def moved(playback: Playback, intent: Intent, result: RunResult) -> Playback:
    """The play head after an intent; the very same one after what does not concern it.

    Args:
        playback: Where it stands.
        intent: What the user wants; times and names come from a browser.
        result: The run that is shown.
    """
    match intent:
        case TogglePlay():
            return replace(playback, playing=not playback.playing)
        case Seek(seconds) if math.isfinite(seconds):
            return playback.seek(seconds)
        case Step(direction):
            return playback.seek(neighbouring_time(result, playback.time, direction))
        case SetSpeed(name) if name in SPEEDS:
            return replace(playback, speed=SPEEDS[name])
        case ChooseWindow(choice):
            window = window_of(result, choice, playback.window)
            return replace(playback.within(window), speed=speed_for(window))
        case Zoom():
            return playback.closer()
        case _:
            return playback
