"""What a session makes of intents about two runs over each other."""

from __future__ import annotations

import queue
import re
from collections.abc import Iterator
from dataclasses import replace

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.compare import (
    CompareRuns,
    CompareUnreadable,
    EndComparison,
    RunsCompared,
    RunsOpened,
    SwapRuns,
)
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.pairing import can_swap, pair_of, with_ghost
from slipgrasp.web.model.playback import slip_window
from slipgrasp.web.model.replay import open_replay
from slipgrasp.web.model.run_list import RunList
from slipgrasp.web.model.view import Ghost, RunStage, RunStatus, Shown, ViewState, show, show_replay
from slipgrasp.web.panels.compare_panel import compare_html
from slipgrasp.web.reducers.compare import CompareReducer
from tests.waiting import PATIENCE
from tests.web.opening import recordings_in
from tests.web.reducing import first_view

REST = 1.0


class Comparison:
    """A reducer of comparisons, its view, and what its worker answered."""

    def __init__(self, store: RecordingStore, view: ViewState) -> None:
        self.answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
        self.reducer = CompareReducer(recordings_in(store), self.answers.put)
        self.view = view

    def ask(self, intent: Intent) -> None:
        self.view = self.reducer.reduce(intent, self.view)

    def hear(self, kind: type[Intent]) -> None:
        answer = self.answers.get(timeout=PATIENCE)
        assert isinstance(answer, kind)
        self.ask(answer)

    def rest(self) -> None:
        """Lets so much time pass that the pair on the screen is compared."""
        for now in (0.0, REST):
            self.view = self.reducer.pass_time(now, self.view)
        self.hear(RunsCompared)

    @property
    def names(self) -> tuple[str, str]:
        """Of the run on the screen and of the ghost."""
        assert self.view.shown is not None and self.view.ghost is not None
        replay = self.view.shown.replay
        return replay.name if replay else "live", self.view.ghost.label


@pytest.fixture
def comparison(store: RecordingStore, stored: tuple[StoredRun, StoredRun]) -> Iterator[Comparison]:
    """With the first of two stored runs on the screen."""
    view = show_replay(first_view(), open_replay(store, stored[0].id))
    comparison = Comparison(store, view)
    yield comparison
    for worker in comparison.reducer.workers:
        worker.close()
        worker.join(30.0)


def test_a_second_run_is_drawn_pale_and_compared(
    comparison: Comparison, stored: tuple[StoredRun, StoredRun], sluggish: RunResult
) -> None:
    comparison.ask(CompareRuns("", stored[1].id))
    assert comparison.view.ghost is None
    comparison.hear(RunsOpened)
    assert comparison.names == ("Q = 20", "Q = 1")
    assert comparison.view.playback is not None
    assert comparison.view.playback.window.end == slip_window(sluggish).end
    comparison.rest()
    comparing = comparison.view.comparing
    assert comparing.pair == pair_of(comparison.view)
    assert comparing.findings is not None
    assert [d.key for d in comparing.findings.scenario] == ["controller.lyapunov_weight"]
    assert comparison.reducer.wait(REST, comparison.view) is None
    comparison.ask(EndComparison())
    assert (comparison.view.ghost, comparison.view.comparing.findings) == (None, None)


def test_two_stored_runs_are_opened_at_once_and_swapped_and_swapped_back(
    comparison: Comparison, stored: tuple[StoredRun, StoredRun]
) -> None:
    comparison.ask(CompareRuns(stored[1].id, stored[0].id))
    comparison.hear(RunsOpened)
    assert comparison.names == ("Q = 1", "Q = 20")
    comparison.rest()
    first = comparison.view.comparing.findings
    assert comparison.view.playback is not None
    time = comparison.view.playback.time
    comparison.ask(SwapRuns())
    assert comparison.names == ("Q = 20", "Q = 1")
    assert comparison.view.playback.time == time
    comparison.rest()
    second = comparison.view.comparing.findings
    assert first is not None and second is not None
    assert first.metrics["slip_path"] == second.metrics["slip_path"][::-1]
    comparison.ask(SwapRuns())
    assert comparison.names == ("Q = 1", "Q = 20")


def test_a_live_run_is_swapped_only_once_it_is_saved(
    comparison: Comparison, store: RecordingStore, stored: tuple[StoredRun, StoredRun]
) -> None:
    assert comparison.view.shown is not None
    result = comparison.view.shown.result
    live = show(first_view(), Shown(5, result, 0.1), RunStage.PREVIEW, afresh=True)
    comparison.view = with_ghost(live, open_replay(store, stored[1].id), -9)
    assert not can_swap(comparison.view)
    comparison.ask(SwapRuns())
    assert comparison.names == ("live", "Q = 1")
    comparison.view = replace(
        comparison.view,
        status=RunStatus(RunStage.SAVED, run_id=stored[0].id),
        run_list=RunList(recent=stored),
    )
    comparison.ask(SwapRuns())
    assert comparison.names == ("Q = 1", "Q = 20")


def test_the_run_before_a_change_is_compared_too_but_not_while_a_control_moves(
    comparison: Comparison, sluggish: RunResult
) -> None:
    before = comparison.view.shown
    assert before is not None
    for ticket, now in enumerate((0.0, 0.1, 0.2), start=10):
        comparison.view = show(
            comparison.view, Shown(ticket, sluggish, 0.1), RunStage.PREVIEW, afresh=False
        )
        comparison.view = replace(comparison.view, ghost=Ghost(before, "the run before"))
        comparison.view = comparison.reducer.pass_time(now, comparison.view)
        assert 0.0 < (comparison.reducer.wait(now, comparison.view) or 0.0) < REST
    assert comparison.answers.empty()
    comparison.view = comparison.reducer.pass_time(REST, comparison.view)
    comparison.hear(RunsCompared)
    assert comparison.view.comparing.pair == (12, before.ticket)
    html = compare_html(comparison.view)
    assert "the run before" in html
    assert re.search(r"controller Lyapunov weight Q</th><td[^>]*>1</td><td[^>]*>20</td>", html)


def test_a_spatial_below_a_planar_run_is_told_to_be_another_kind_of_hand(
    comparison: Comparison, store: RecordingStore
) -> None:
    short = {"simulation.duration": 0.02}
    planar, spatial = (
        store.save(simulate(with_values(load_scenario(name), short))).id
        for name in ("three-fingers", "spatial-box")
    )
    comparison.ask(CompareRuns(planar, spatial))
    comparison.hear(RunsOpened)
    comparison.rest()
    assert comparison.view.comparing.findings is None
    assert "a planar and a spatial hand cannot be compared" in compare_html(comparison.view)


def test_a_run_that_is_gone_is_explained_and_the_screen_stays(comparison: Comparison) -> None:
    shown = comparison.view.shown
    comparison.ask(CompareRuns("", "abcdefghijkl"))
    comparison.hear(CompareUnreadable)
    assert comparison.view.shown is shown
    assert "there is no recording &#x27;abcdefghijkl&#x27;" in compare_html(comparison.view)


def test_an_answer_that_comes_after_another_request_is_left_out(
    comparison: Comparison, stored: tuple[StoredRun, StoredRun]
) -> None:
    comparison.ask(CompareRuns("", stored[1].id))
    comparison.view = replace(comparison.view, opening=comparison.view.opening + 1)
    comparison.hear(RunsOpened)
    assert comparison.view.ghost is None
