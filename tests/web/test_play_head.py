"""What the intents of a user make of the play head."""

from __future__ import annotations

import math

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import FrameHand
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
from slipgrasp.web.model.playback import Playback, TimeWindow, WindowChoice
from slipgrasp.web.reducers.playback import choice_after, moved

PLAYING = Playback(time=1.5, window=TimeWindow(1.0, 3.0), speed=0.5, playing=True)


def test_play_and_pause(case_1: RunResult) -> None:
    paused = moved(PLAYING, TogglePlay(), case_1)
    assert not paused.playing
    assert moved(paused, TogglePlay(), case_1).playing


def test_a_seek_goes_to_the_time_and_rests_there(case_1: RunResult) -> None:
    sought = moved(PLAYING, Seek(2.25), case_1)
    assert (sought.time, sought.playing) == (2.25, False)


@pytest.mark.parametrize(
    "hostile",
    [
        Seek(math.nan),
        Seek(math.inf),
        ShowWindow(math.nan, 1.0),
        SetSpeed("1e9"),
        SetSpeed(""),
        FrameHand(),
    ],
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


def test_a_jump_goes_to_the_events_of_the_run_and_takes_the_window_along(
    case_1: RunResult,
) -> None:
    back = moved(PLAYING, JumpToEvent(-1), case_1)
    last_change = case_1.phase_changes[-1].time
    assert (back.time, back.playing) == (last_change, False)
    assert back.window.start <= last_change <= back.window.end
    assert back.window.length == pytest.approx(PLAYING.window.length)
    end = moved(PLAYING, JumpToEvent(1), case_1)
    assert (end.time, end.window) == (7.0, TimeWindow(5.0, 7.0))


def test_the_edges_are_those_of_the_window(case_1: RunResult) -> None:
    assert moved(PLAYING, GoToEdge(-1), case_1).time == 1.0
    assert moved(PLAYING, GoToEdge(1), case_1).time == 3.0


def test_an_edge_of_the_range_is_followed_by_that_of_the_run(case_1: RunResult) -> None:
    for direction, time in ((-1, 0.0), (1, case_1.end_time)):
        there = moved(moved(PLAYING, GoToEdge(direction), case_1), GoToEdge(direction), case_1)
        assert there.time == time
        assert there.window.start <= time <= there.window.end
        assert there.window.length == pytest.approx(PLAYING.window.length)


def test_the_speed_goes_up_and_down_as_far_as_there_are_speeds(case_1: RunResult) -> None:
    assert moved(PLAYING, ChangeSpeed(1), case_1).speed == 1.0
    assert moved(PLAYING, ChangeSpeed(-1), case_1).speed == 0.25
    fast = PLAYING
    for _ in range(20):
        fast = moved(fast, ChangeSpeed(1), case_1)
    assert fast.speed == 4.0


def test_a_marked_stretch_is_shown_in_any_order_and_never_leaves_the_run(
    case_1: RunResult,
) -> None:
    shown = moved(PLAYING, ShowWindow(2.5, 1.25), case_1)
    assert shown.window == TimeWindow(1.25, 2.5)
    assert moved(PLAYING, ShowWindow(-9.0, 99.0), case_1).window == TimeWindow(0.0, 7.0)
    narrow = moved(PLAYING, ShowWindow(7.0, 7.0), case_1).window
    assert (narrow.end, narrow.length) == (7.0, pytest.approx(1e-3))


def test_another_stretch_than_the_named_ones_is_a_closer_look(case_1: RunResult) -> None:
    for intent, choice in (
        (ChooseWindow(WindowChoice.WHOLE), WindowChoice.WHOLE),
        (ShowWindow(2.0, 2.5), WindowChoice.CLOSER),
        (JumpToEvent(1), WindowChoice.CLOSER),
        (Seek(2.0), WindowChoice.SLIP),
    ):
        after = moved(PLAYING, intent, case_1)
        assert choice_after(WindowChoice.SLIP, intent, PLAYING, after) is choice


def test_a_closer_look_at_an_end_stays_in_the_run(case_1: RunResult) -> None:
    closer = moved(PLAYING.seek(3.0), Zoom(), case_1)
    assert closer.window.end == 3.0
    assert closer.window.start <= closer.time <= closer.window.end
