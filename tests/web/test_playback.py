"""The play head, without a viewer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.playback import (
    SPEEDS,
    Playback,
    TimeWindow,
    WindowChoice,
    neighbouring_time,
    slip_window,
    speed_for,
    start_playback,
    whole_window,
    window_of,
)
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState, show

EMPTY = ViewState(
    Draft.from_preset("paper-case-2"), RunStatus(RunStage.SIMULATING), WindowChoice.SLIP
)
WINDOW = TimeWindow(1.0, 3.0)
PLAYING = Playback(time=1.5, window=WINDOW, speed=0.5, playing=True)


def test_the_play_head_moves_at_its_speed() -> None:
    assert PLAYING.advance(0.4).time == pytest.approx(1.7)


def test_the_play_head_wraps_from_the_end_of_its_window_to_the_start() -> None:
    assert PLAYING.advance(4.0).time == pytest.approx(1.5)
    assert PLAYING.advance(3.2).time == pytest.approx(1.1)


def test_a_paused_play_head_stays() -> None:
    paused = replace(PLAYING, playing=False)
    assert paused.advance(10.0) is paused


def test_a_window_without_length_does_not_move_the_play_head() -> None:
    empty = replace(PLAYING, window=TimeWindow(1.5, 1.5))
    assert empty.advance(1.0).time == 1.5


def test_seeking_pauses_and_stays_in_the_window() -> None:
    sought = PLAYING.seek(99.0)
    assert (sought.time, sought.playing) == (3.0, False)


def test_another_window_takes_the_play_head_along() -> None:
    assert PLAYING.within(TimeWindow(2.0, 4.0)).time == 2.0
    assert PLAYING.within(TimeWindow(0.0, 2.0)).time == 1.5


def test_the_slip_window_holds_all_slip_and_some_rest_after_it(case_2: RunResult) -> None:
    window = slip_window(case_2)
    last = case_2.metrics.last_slip_time
    assert last is not None
    assert window.start == 0.0
    assert last * 1.2 < window.end < last * 2.0


def test_the_slip_window_also_shows_what_follows_a_push_in_it() -> None:
    pushes = [{"time": 0.1, "force": [1.0, 0.0]}, {"time": 3.0, "force": [1e-3, 0.0]}]
    case = load_scenario("paper-case-1")
    plain, pushed = (
        slip_window(simulate(with_values(case, values))) for values in ({}, {"pulses": pushes})
    )
    assert plain.end < 0.15 < pushed.end < 0.3


def test_the_slip_window_of_a_run_without_slip_is_the_whole_run(case_2: RunResult) -> None:
    at_rest = replace(case_2.trace, phase=np.zeros_like(case_2.trace.phase))
    assert slip_window(replace(case_2, trace=at_rest)) == whole_window(case_2)


def test_a_late_slip_gives_a_window_around_it(case_2: RunResult) -> None:
    phase = np.zeros_like(case_2.trace.phase)
    phase[(case_2.trace.times > 3.0) & (case_2.trace.times < 4.0), 1] = -1
    window = slip_window(replace(case_2, trace=replace(case_2.trace, phase=phase)))
    assert 2.5 < window.start < 3.0 < 4.0 < window.end < 5.0


def test_the_first_picture_shows_slip_in_slow_motion(case_1: RunResult) -> None:
    playback = start_playback(case_1)
    row = np.searchsorted(case_1.trace.times, playback.time)
    assert (case_1.trace.phase[row] != 0).all()
    assert playback.playing
    assert playback.speed < 0.1


def test_a_closer_look_stays_when_the_run_changes_but_never_leaves_it(case_1: RunResult) -> None:
    assert window_of(case_1, WindowChoice.CLOSER, WINDOW) == WINDOW
    assert window_of(case_1, WindowChoice.CLOSER, TimeWindow(6.0, 9.0)) == TimeWindow(6.0, 7.0)
    assert window_of(case_1, WindowChoice.CLOSER, TimeWindow(8.0, 9.0)) == TimeWindow(0.0, 7.0)


@pytest.mark.parametrize("length", [0.006, 0.02, 0.2, 7.0, 60.0])
def test_one_pass_takes_some_seconds_at_the_proposed_speed(length: float) -> None:
    speed = speed_for(TimeWindow(0.0, length))
    assert speed in SPEEDS.values()
    assert 1.0 < length / speed < 20.0


def test_stepping_visits_every_stored_time_once(case_2: RunResult) -> None:
    times = np.unique(case_2.trace.times)[:40]
    visited = [0.0]
    while len(visited) < len(times):
        visited.append(neighbouring_time(case_2.trace.times, visited[-1], 1))
    assert visited == pytest.approx(list(times))
    assert neighbouring_time(case_2.trace.times, visited[-1], -1) == visited[-2]
    assert neighbouring_time(case_2.trace.times, 0.0, -1) == 0.0
    assert math.isclose(neighbouring_time(case_2.trace.times, 7.0, 1), 7.0)


def test_a_slip_of_milliseconds_fills_the_window_and_plays_for_seconds() -> None:
    result = simulate(with_values(load_scenario("wet-patch"), {"simulation.duration": 4.0}))
    begin, end = (change.time for change in result.phase_changes[:2])
    assert end - begin < 0.005
    playback = start_playback(result)
    assert (end - begin) / playback.window.length > 0.5
    assert 2.0 < (end - begin) / playback.speed < 10.0


def test_another_run_is_played_at_a_speed_that_suits_it_unless_one_was_chosen(
    case_1: RunResult, case_2: RunResult
) -> None:
    short = simulate(with_values(load_scenario("wet-patch"), {"simulation.duration": 4.0}))
    first = show(EMPTY, Shown(1, case_2, 0.0), RunStage.PREVIEW, afresh=True)
    assert first.playback is not None
    then = show(first, Shown(2, short, 0.0), RunStage.PREVIEW, afresh=False)
    assert then.playback is not None
    assert then.playback.speed == speed_for(then.playback.window) < first.playback.speed
    chosen = replace(first, playback=replace(first.playback, speed=1.0))
    kept = show(chosen, Shown(2, short, 0.0), RunStage.PREVIEW, afresh=False)
    assert kept.playback is not None
    assert kept.playback.speed == 1.0
