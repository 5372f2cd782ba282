"""Playback that is slow where something slips, and the next slip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.model.events import next_slip_time
from slipgrasp.web.model.intents.playback import ChangeSpeed, GoToNextSlip, SetSpeed
from slipgrasp.web.model.pace import Pace, is_even, pace_of
from slipgrasp.web.model.playback import PACED, start_playback, whole_window
from slipgrasp.web.page.routes import STATIC_PATH
from slipgrasp.web.reducers.playback import moved
from tests.waiting import wait_until
from tests.web.driving import choose_scenario, pause_at, told, wait_for_time

PACE = Pace((0.0, 1.0, 9.0), (0.1, 8.0, 0.5))
ADVANCE = """async ([folder, playback, seconds]) => {
    const {advance} = await import(`${folder}/pace.js`);
    return seconds.map((each) => advance(playback, each));
}"""


def slipping(result: RunResult, *spans: tuple[float, float]) -> RunResult:
    """The run with slip in some ranges of time alone."""
    times, phase = result.trace.times, np.zeros_like(result.trace.phase)
    for start, end in spans:
        phase[(times >= start) & (times <= end), 0] = ContactPhase.SLIP_FORWARD
    return replace(result, trace=replace(result.trace, phase=phase))


def test_each_piece_of_a_run_is_played_at_its_speed_over_and_over() -> None:
    times = [PACE.advance(0.0, each, 0.0, 10.0) for each in (1.0, 10.5, 11.0, 12.0, 13.0, 14.0)]
    assert times == pytest.approx([0.1, 5.0, 9.0, 9.5, 0.0, 0.1])
    assert PACE.advance(9.5, 1.0, 9.0, 9.75) == pytest.approx(9.25)
    assert PACE.advance(9.75, 0.5, 9.0, 9.75) == pytest.approx(9.25)


def test_slips_that_are_far_apart_are_slow_and_the_time_between_them_is_fast(
    case_1: RunResult,
) -> None:
    run = slipping(case_1, (1.0, 1.1), (5.0, 5.4))
    pace = pace_of(run)
    assert len(pace.starts) == 5
    before, first, between, second, after = pace.speeds
    assert first < second < before < after < between
    for start, end in ((1.0, 1.1), (5.0, 5.4)):
        seconds = (end - start) / pace.speeds[1 if start < 2.0 else 3]
        assert 1.0 < seconds < 3.5
    assert not is_even(run, 0.9, 5.5)
    assert start_playback(run).pace == pace


def test_one_slip_is_played_at_one_speed(case_1: RunResult) -> None:
    assert start_playback(case_1).pace is None


def test_a_run_without_slip_or_with_many_takes_some_seconds(case_1: RunResult) -> None:
    still = pace_of(slipping(case_1))
    assert len(still.speeds) == 1
    many = slipping(case_1, *((k, k + 0.05) for k in np.arange(0.1, 7.0, 0.25).tolist()))
    pace, end = pace_of(many), case_1.end_time
    played = np.diff([*pace.starts, end]) / pace.speeds
    assert 10.0 < played.sum() < 60.0


def test_the_pace_is_chosen_as_a_speed_and_left_for_another(case_1: RunResult) -> None:
    playback = start_playback(case_1)
    paced = moved(playback, SetSpeed(PACED), case_1)
    assert paced.pace == pace_of(case_1)
    assert moved(paced, SetSpeed("1/4"), case_1).pace is None
    assert moved(paced, ChangeSpeed(1), case_1).pace is None
    window = whole_window(case_1)
    reached = replace(paced, time=window.start, window=window).advance(0.1).time
    assert 0.0 < reached < 0.05


def test_the_next_slip_follows_and_after_the_last_comes_the_first() -> None:
    run = simulate(load_scenario("shake-test"))
    onsets = [c.time for c in run.phase_changes if c.to_phase is not ContactPhase.STICK]
    playback = start_playback(run).seek(0.0)
    for onset in sorted({each for each in onsets if each > 0.0}):
        playback = moved(playback, GoToNextSlip(), run)
        assert (playback.time, playback.playing) == (onset, False)
        assert playback.window.start <= onset <= playback.window.end
    assert moved(playback, GoToNextSlip(), run).time == min(onsets)


def test_a_run_without_slip_has_no_next_one(case_1: RunResult) -> None:
    still = replace(case_1, phase_changes=())
    assert next_slip_time(still, 0.0) is None
    playback = start_playback(case_1)
    assert moved(playback, GoToNextSlip(), still) is playback


@pytest.mark.browser
def test_the_page_moves_the_play_head_as_the_session_does(blank: Page) -> None:
    seconds = np.random.default_rng(6).uniform(0.0, 40.0, 50).tolist()
    playback = {"time": 0.3, "start": 0.2, "end": 9.5, "pace": list(zip(*PACE, strict=True))}
    moves = blank.evaluate(ADVANCE, [STATIC_PATH, playback, seconds])
    expected = [PACE.advance(0.3, each, 0.2, 9.5) for each in seconds]
    assert moves == pytest.approx(expected)
    steady = playback | {"pace": None, "speed": 0.5}
    assert blank.evaluate(ADVANCE, [STATIC_PATH, steady, [20.0]]) == pytest.approx([1.0])


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_run_plays_at_the_pace_of_its_slips_and_its_timeline_zooms(page: Page) -> None:
    choose_scenario(page, "shake-test")
    page.locator(".sg-origin", has_text="shake-test").wait_for()
    run = simulate(load_scenario("shake-test"))
    page.get_by_label("speed", exact=True).select_option(PACED)
    pace = [list(piece) for piece in zip(*pace_of(run), strict=True)]
    wait_until(lambda: told(page)["pace"] == pace, lambda: told(page)["pace"])
    pause_at(page, 0.0)
    page.keyboard.press("n")
    onset = next_slip_time(run, 0.0)
    assert onset is not None
    wait_for_time(page, onset)
    before = told(page)
    page.locator("[data-sg-track]").hover()
    page.mouse.wheel(0, -100)
    wait_until(lambda: told(page)["end"] < before["end"], "the timeline does not zoom")
    now = told(page)
    length = before["end"] - before["start"]
    assert now["end"] - now["start"] == pytest.approx(length / 1.25, rel=1e-3)
    middle = 0.5 * (before["start"] + before["end"])
    assert 0.5 * (now["start"] + now["end"]) == pytest.approx(middle, abs=0.02 * length)
    page.get_by_label("speed", exact=True).select_option("1/4")
    wait_until(lambda: told(page)["pace"] is None, "it keeps its pace")
