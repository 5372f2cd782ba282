"""What a session makes of its user's intents, without a viewer."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from pydantic import ValidationError

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.mailbox import Mailbox, coalesce
from slipgrasp.web.model.intents.picture import MeasurePage
from slipgrasp.web.model.intents.playback import ChooseWindow, Seek, Step, TogglePlay
from slipgrasp.web.model.intents.scenario import (
    ChoosePreset,
    RemoveChange,
    ResetScenario,
    SetParameter,
    Undo,
)
from slipgrasp.web.model.page_layout import PageLayout
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.view import RunStage, ViewState
from slipgrasp.web.page.intents_schema import PageGestures, posted
from slipgrasp.web.reducers.frame_pacing import FRAME_INTERVAL, FramePacer
from slipgrasp.web.reducers.playback import PlaybackReducer
from slipgrasp.web.reducers.runs import is_save_due
from tests.web.reducing import AT_REST, view_of


def test_only_the_last_value_of_a_dragged_control_counts() -> None:
    drag = [SetParameter("object.mass", 0.1 * i) for i in range(20)]
    other = SetParameter("fingers.0.friction", 0.4)
    assert coalesce([*drag[:10], other, *drag[10:]]) == [other, drag[-1]]


def test_intents_that_add_up_are_all_kept_in_order() -> None:
    intents = [Step(1), TogglePlay(), Step(1), TogglePlay(), Step(-1)]
    assert coalesce(intents) == intents


def test_a_reset_stays_where_it_was_among_the_edits() -> None:
    early, late = SetParameter("object.mass", 2.0), SetParameter("object.inertia", 0.02)
    assert coalesce([early, ResetScenario(), late]) == [early, ResetScenario(), late]


def test_a_control_acts_at_the_play_head_that_it_was_turned_at() -> None:
    turned = SetParameter("object.mass", 1.7)
    assert coalesce([Seek(0.9), Seek(1.0), turned, Seek(2.0)]) == [Seek(1.0), turned, Seek(2.0)]


def test_what_is_undone_is_what_was_asked_for_before_it() -> None:
    first, second = SetParameter("object.mass", 1.7), SetParameter("object.mass", 1.9)
    assert coalesce([first, Undo(), second]) == [first, Undo(), second]


def test_the_mailbox_gives_a_whole_batch_and_then_nothing() -> None:
    mailbox = Mailbox()
    for time in (0.1, 0.2, 0.3):
        mailbox.send(Seek(time))
    mailbox.send(ChoosePreset("paper-case-1"))
    assert mailbox.receive(0.0) == [Seek(0.3), ChoosePreset("paper-case-1")]
    assert mailbox.receive(0.0) == []


@pytest.mark.parametrize(
    ("stage", "rested", "due"),
    [
        (RunStage.PREVIEW, 0.49, False),
        (RunStage.PREVIEW, 0.5, True),
        (RunStage.SIMULATING, 9.0, False),
        (RunStage.SAVED, 9.0, False),
    ],
)
def test_a_run_is_saved_once_its_controls_have_rested(
    stage: RunStage, rested: float, due: bool
) -> None:
    assert is_save_due(stage, rested) is due


def test_reducers_with_nothing_to_do_let_the_session_sleep(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=False), PlaybackReducer(FramePacer())
    assert reducer.pass_time(1.0, view) is view
    assert reducer.wait(1.0, view) is None


def test_a_playing_session_draws_thirty_frames_a_second(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=True), PlaybackReducer(FramePacer())
    reducer.pass_time(1.0, view)
    assert reducer.wait(1.0, view) == pytest.approx(1.0 / 30.0)
    assert reducer.wait(5.0, view) == 0.0


def test_a_frame_that_was_late_does_not_delay_the_next_one(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=True), PlaybackReducer(FramePacer())
    reducer.pass_time(1.0, view)
    reducer.pass_time(1.04, view)
    assert reducer.wait(1.04, view) == pytest.approx(2.0 / 30.0 - 0.04)


def test_whatever_else_wakes_a_session_draws_no_frame_before_it_is_due(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=True), PlaybackReducer(FramePacer())
    reducer.pass_time(1.0, view)
    assert reducer.pass_time(1.01, view) is view
    assert reducer.pass_time(1.04, view) is not view


def test_no_frame_is_drawn_while_the_last_one_is_not_sent_and_then_the_time_is_right(
    case_1: RunResult,
) -> None:
    behind = [True]
    view = _view(case_1, playing=True)
    reducer = PlaybackReducer(FramePacer(), lambda: behind[0])
    assert reducer.pass_time(0.9, view) is view
    assert reducer.wait(0.9, view) == pytest.approx(1.0 / 30.0)
    behind[0] = False
    reducer.pass_time(1.0, view)
    behind[0] = True
    assert reducer.pass_time(1.2, view) is view
    behind[0] = False
    later = reducer.pass_time(1.4, view)
    assert later.playback is not None
    assert later.playback.time == pytest.approx(0.2 + 0.4 * 0.25)


def test_play_goes_on_from_where_the_play_head_rested(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=False), PlaybackReducer(FramePacer())
    reducer.pass_time(1.0, view)
    resumed = reducer.pass_time(4.0, reducer.reduce(TogglePlay(), view))
    assert resumed.playback is not None
    assert (resumed.playback.time, resumed.playback.playing) == (0.2, True)
    paused = reducer.reduce(TogglePlay(), resumed).playback
    assert paused is not None and not paused.playing


def test_the_play_head_moves_with_the_clock_times_its_speed(case_1: RunResult) -> None:
    view, reducer = _view(case_1, playing=True), PlaybackReducer(FramePacer())
    first = reducer.pass_time(1.0, view)
    later = reducer.pass_time(1.5, first)
    assert first.playback == view.playback
    assert later.playback is not None
    assert later.playback.time == pytest.approx(0.2 + 0.5 * 0.25)


def test_one_viewer_is_drawn_thirty_frames_and_many_share_the_processor() -> None:
    pacer = FramePacer()
    pacer.drew(0, 0.003, now=10.0)
    assert pacer.interval(10.0) == FRAME_INTERVAL
    for session in range(20):
        pacer.drew(session, 0.003, now=10.5)
    crowded = pacer.interval(10.6)
    assert 20 * 0.003 / crowded < 0.7
    assert crowded < 0.2
    assert pacer.interval(20.0) == FRAME_INTERVAL


def _view(result: RunResult, *, playing: bool) -> ViewState:
    return view_of(result, playback=replace(AT_REST, time=0.2, speed=0.25, playing=playing))


def test_a_preset_is_chosen_by_name_never_by_path(tmp_path) -> None:
    path = tmp_path / "secret.toml"
    path.write_text("title = 'not a preset'")
    with pytest.raises(ScenarioError, match="paper-case-1"):
        Draft.from_preset(str(path))


@pytest.mark.parametrize(
    "intent",
    [
        Seek(0.5),
        Undo(),
        ChooseWindow(WindowChoice.WHOLE),
        RemoveChange(0.25, "object.mass"),
        MeasurePage(PageLayout(1440, 900, 740, 900, 220), prefers_dark=True),
    ],
)
def test_what_a_page_posts_comes_out_as_the_intent_it_was_made_of(intent: Intent) -> None:
    wire = json.loads(json.dumps(posted(intent)))
    assert PageGestures.model_validate([wire]).intents() == [intent]


@pytest.mark.parametrize(
    "gesture",
    [
        {"kind": "set-parameter", "key": "object.mass", "value": 1.0},
        {"kind": "delete-recording", "run_id": "abcdefghijkl", "revision": ""},
        {"kind": "choose-window", "choice": "closer"},
        {"kind": "list-recordings", "page": -1},
        {"kind": "list-recordings", "page": 1.0},
        {"kind": "remove-change", "time": 0.1, "key": "k" * 101},
        {"kind": "see-study-draft", "is_visible": 1},
        {"kind": "undo", "more": 1},
    ],
)
def test_a_page_can_post_nothing_else(gesture: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        PageGestures.model_validate([gesture])
