"""What the intents of a user make of the play head."""

from __future__ import annotations

import math

import pytest

from core.result import RunResult
from web.intents.intent import Intent
from web.intents.picture import FrameHand
from web.intents.playback import ChooseWindow, Seek, SetSpeed, Step, TogglePlay, Zoom
from web.play_head import moved
from web.playback import Playback, TimeWindow, WindowChoice

PLAYING = Playback(time=1.5, window=TimeWindow(1.0, 3.0), speed=0.5, playing=True)


def test_play_and_pause(case_1: RunResult) -> None:
    paused = moved(PLAYING, TogglePlay(), case_1)
    assert not paused.playing
    assert moved(paused, TogglePlay(), case_1).playing


def test_a_seek_goes_to_the_time_and_rests_there(case_1: RunResult) -> None:
    sought = moved(PLAYING, Seek(2.25), case_1)
    assert (sought.time, sought.playing) == (2.25, False)


@pytest.mark.parametrize(
    "hostile", [Seek(math.nan), Seek(math.inf), SetSpeed("1e9"), SetSpeed(""), FrameHand()]
)
def test_what_no_control_can_ask_for_changes_nothing(case_1: RunResult, hostile: Intent) -> None:
    assert moved(PLAYING, hostile, case_1) is PLAYING


def test_a_step_goes_to_a_stored_time(case_1: RunResult) -> None:
    stepped = moved(PLAYING, Step(1), case_1)
    assert stepped.time in case_1.trace.times
    assert stepped.time > 1.5


def test_a_window_brings_its_own_speed(case_1: RunResult) -> None:
    whole = moved(PLAYING, ChooseWindow(WindowChoice.WHOLE), case_1)
    assert whole.window == TimeWindow(0.0, 7.0)
    assert whole.speed == 1.0


def test_a_closer_look_stays_around_the_play_head_and_plays_slower(case_1: RunResult) -> None:
    closer = moved(PLAYING, Zoom(), case_1)
    assert closer.window == TimeWindow(1.25, 1.75)
    assert (closer.time, closer.playing) == (1.5, True)
    assert closer.speed < PLAYING.speed
    for _ in range(20):
        closer = moved(closer, Zoom(), case_1)
    assert closer.window.length == pytest.approx(1e-3)


def test_a_closer_look_at_an_end_stays_in_the_run(case_1: RunResult) -> None:
    closer = moved(PLAYING.seek(3.0), Zoom(), case_1)
    assert closer.window.end == 3.0
    assert closer.window.start <= closer.time <= closer.window.end
