"""What a session makes of a link to a run and a time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.recordings import (
    OpenLink,
    OpenRecording,
    RecordingOpened,
    RecordingUnreadable,
)
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import ViewState, show_replay
from slipgrasp.web.reducers.link import LinkReducer, linked_time
from tests.web.reducing import first_view

RUN = "abcdefghijkl"
NUMBER = 1


class Followed:
    """A reducer that was given a link, and the recording that answers it."""

    def __init__(self, result: RunResult, link: OpenLink) -> None:
        self.sent: list[Intent] = []
        self.reducer = LinkReducer(self.sent.append)
        self.replay = Replay("name", "long ago", result, RUN)
        self.view = replace(self.reducer.reduce(link, first_view()), opening=NUMBER)

    def arrive(self, number: int = NUMBER) -> ViewState:
        shown = show_replay(self.view, self.replay)
        return self.reducer.reduce(RecordingOpened(number, self.replay), shown)


def test_the_run_is_asked_for_and_the_play_head_rests_at_the_time(case_2: RunResult) -> None:
    followed = Followed(case_2, OpenLink(RUN, "0.05"))
    assert followed.sent == [OpenRecording(RUN)]
    playback = followed.arrive().playback
    assert playback is not None
    assert (playback.time, playback.playing) == (0.05, False)


@pytest.mark.parametrize(("written", "time"), [("2.5", 2.5), ("99", 7.0), ("-3", 0.0)])
def test_a_time_outside_the_window_or_the_run_is_moved_into_the_run(
    case_2: RunResult, written: str, time: float
) -> None:
    playback = Followed(case_2, OpenLink(RUN, written)).arrive().playback
    assert playback is not None
    assert playback.time == time
    assert 0.0 <= playback.window.start <= time <= playback.window.end <= 7.0


@pytest.mark.parametrize("written", ["soon", "nan", "inf", "1e999", "2,5"])
def test_a_time_that_is_none_is_told_and_the_run_is_shown_anyway(
    case_2: RunResult, written: str
) -> None:
    view = Followed(case_2, OpenLink(RUN, written)).arrive()
    assert linked_time(written) is None
    assert written in view.notice
    assert view.shown is not None and view.playback is not None and view.playback.playing


def test_a_run_that_is_not_there_is_told(case_2: RunResult) -> None:
    followed = Followed(case_2, OpenLink("nope", "1"))
    answer = RecordingUnreadable(NUMBER, "there is no recording 'nope'")
    assert followed.reducer.reduce(answer, followed.view).notice == (
        "The link could not be opened: there is no recording 'nope'."
    )


def test_a_link_without_a_time_shows_the_run_as_it_begins(case_2: RunResult) -> None:
    view = Followed(case_2, OpenLink(RUN, "")).arrive()
    assert view.notice == ""
    assert view.playback is not None and view.playback.playing


def test_a_link_is_forgotten_once_the_user_wants_something_else(case_2: RunResult) -> None:
    followed = Followed(case_2, OpenLink(RUN, "2.5"))
    followed.reducer.reduce(OpenRecording("another"), followed.view)
    playback = followed.arrive().playback
    assert playback is not None and playback.time != 2.5
    late = Followed(case_2, OpenLink(RUN, "2.5"))
    assert late.arrive(number=NUMBER + 1).playback.time != 2.5
