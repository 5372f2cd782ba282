"""What becomes of a draft: its run, the ghost of the one before, a recording shown again."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.scenario import (
    ChoosePreset,
    SetParameter,
    Undo,
)
from slipgrasp.web.model.playback import TimeWindow, WindowChoice
from slipgrasp.web.model.replay import open_replay
from slipgrasp.web.model.view import Ghost, RunStage, RunStatus, Shown, ViewState, show_replay
from slipgrasp.web.reducers.runs import RunReducer
from slipgrasp.web.reducers.scenario import ScenarioReducer
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.saved_runs import SavedRuns
from tests.server.serving import patient_settings
from tests.waiting import PATIENCE

MASS, INERTIA = "object.mass", "object.inertia"


@dataclass
class Bench:
    """The two reducers that make runs, their answers, and what is on the screen."""

    scenario: ScenarioReducer
    runs: RunReducer
    answers: queue.SimpleQueue[Intent]
    store: RecordingStore
    view: ViewState
    now: float = 0.0

    def do(self, *intents: Intent) -> ViewState:
        """Takes intents one by one and waits for the run that each of them asks for."""
        for intent in intents:
            self.view = self.scenario.reduce(intent, self.view)
            self.settle()
        return self.view

    def settle(self) -> ViewState:
        ticket = self.view.ticket
        self.view = self.runs.pass_time(self.now, self.view)
        shown = self.view.shown.ticket if self.view.shown else 0
        if self.view.ticket not in (ticket, shown) and is_allowed(self.view.draft):
            self.hear()
        return self.view

    def hear(self) -> None:
        answer = self.answers.get(timeout=PATIENCE)
        self.view = self.runs.reduce(answer, self.view)

    def wait(self, seconds: float) -> ViewState:
        self.now += seconds
        return self.settle()

    @property
    def slip(self) -> float:
        assert self.view.shown is not None
        return self.view.shown.result.metrics.slip_path[0]

    def pause_at(self, time: float) -> None:
        assert self.view.playback is not None
        self.view = replace(self.view, playback=self.view.playback.seek(time))


def is_allowed(draft: Draft) -> bool:
    try:
        draft.scenario()
    except ScenarioError:
        return False
    return True


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    settings = patient_settings(tmp_path / "data")
    store = RecordingStore(settings.data_directory)
    service = RunService(store, settings)
    answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
    runs = RunReducer(LiveRuns(service), SavedRuns(service), answers.put, simulates_first=True)
    first = ViewState(
        draft=Draft.from_preset("paper-case-1"),
        status=RunStatus(RunStage.SIMULATING),
        choice=WindowChoice.WHOLE,
    )
    bench = Bench(ScenarioReducer(), runs, answers, store, runs.start(first))
    bench.settle()
    bench.pause_at(0.05)
    yield bench
    for worker in runs.workers:
        worker.close()
        worker.join(10.0)
    service.close()


def test_the_run_before_a_gesture_stays_as_a_ghost_until_it_is_dismissed(bench: Bench) -> None:
    first = bench.view.shown
    for mass in (1.2, 1.3, 1.4):
        view = bench.do(SetParameter(MASS, mass))
    assert view.ghost is not None
    assert view.ghost.shown is first
    assert view.ghost.label == f"the run before: {first.name}"
    last = view.shown
    view = bench.do(SetParameter(INERTIA, 0.02))
    assert view.ghost is not None
    assert view.ghost.shown is last
    bench.view = replace(bench.view, ghost=None)
    assert bench.do(EndComparison(), SetParameter(INERTIA, 0.03)).ghost is None


def test_a_chosen_ghost_stays_and_another_scenario_has_none(bench: Bench) -> None:
    assert bench.view.shown is not None
    chosen = Ghost(bench.view.shown, "chosen", is_chosen=True)
    bench.view = replace(bench.view, ghost=chosen)
    assert bench.do(SetParameter(MASS, 1.4)).ghost is chosen
    bench.view = replace(bench.view, ghost=None)
    assert bench.do(SetParameter(INERTIA, 0.02)).ghost is not None
    assert bench.do(ChoosePreset("paper-case-2")).ghost is None


def test_drawing_waits_for_a_short_run_but_not_for_long(bench: Bench) -> None:
    assert not bench.runs.expects_answer(0.0)
    bench.view = bench.scenario.reduce(SetParameter(MASS, 1.3), bench.view)
    bench.view = bench.runs.pass_time(5.0, bench.view)
    assert bench.runs.expects_answer(5.0)
    assert bench.runs.wait(5.01, bench.view) == pytest.approx(0.09)
    # Another control does not put it off any further.
    bench.view = bench.scenario.reduce(SetParameter(MASS, 1.4), bench.view)
    bench.view = bench.runs.pass_time(5.02, bench.view)
    assert not bench.runs.expects_answer(5.101)

    bench.hear()
    while bench.view.shown is None or bench.view.shown.ticket != bench.view.ticket:
        bench.hear()
    assert not bench.runs.expects_answer(5.0)


def test_a_control_that_moves_faster_than_its_runs_shows_every_one_that_is_done(
    bench: Bench,
) -> None:
    for k in range(1, 4):
        drafts = []
        for j in range(3):
            move = SetParameter(MASS, 1.3 + 0.1 * k + 0.01 * j)
            bench.view = bench.scenario.reduce(move, bench.view)
            bench.view = bench.runs.pass_time(k + 0.02 * j, bench.view)
            drafts.append(bench.view.draft)
        # The first one, and then the last one.
        for draft in (drafts[0], drafts[-1]):
            bench.hear()
            assert bench.view.shown is not None
            assert bench.view.shown.result.scenario == draft.scenario()
            bench.view = bench.runs.pass_time(k + 0.1, bench.view)


def test_a_slow_run_gives_way_to_a_newer_draft(bench: Bench) -> None:
    for seconds, mass in ((5.0, 1.3), (5.4, 1.4), (5.6, 1.5)):
        ticket = bench.view.ticket
        bench.view = bench.scenario.reduce(SetParameter(MASS, mass), bench.view)
        bench.view = bench.runs.pass_time(seconds, bench.view)
        assert (bench.view.ticket > ticket) == (mass != 1.4)


def test_a_refused_draft_names_the_field_and_keeps_run_and_ghost(bench: Bench) -> None:
    first = bench.view.shown
    view = bench.do(SetParameter(MASS, -1.0))
    assert view.status.stage is RunStage.REFUSED
    assert view.status.messages[0].startswith("object.mass is -1.0")
    assert [view.draft.key_of(error) for error in view.status.errors] == [MASS]
    assert (view.shown, view.ghost) == (first, None)
    view = bench.do(SetParameter(MASS, 1.2))
    assert view.status.stage is RunStage.PREVIEW
    assert view.ghost is not None
    assert view.ghost.shown is first


def test_a_resting_play_head_stays_where_the_control_acts(bench: Bench) -> None:
    assert bench.view.playback is not None
    wide = replace(bench.view.playback, window=TimeWindow(0.0, 7.0)).seek(3.0)
    bench.view = replace(bench.view, choice=WindowChoice.SLIP, playback=wide)
    view = bench.do(SetParameter(MASS, 1.05))
    assert view.playback is not None
    assert view.playback.time == 3.0
    assert view.draft.changes[0].time == 3.0


def test_a_run_is_saved_once_its_controls_rest(bench: Bench) -> None:
    for i in range(10):
        bench.now += 0.1
        bench.do(SetParameter(MASS, 1.0 + 0.1 * i))
    bench.wait(0.3)
    assert bench.store.count() == 0
    assert bench.wait(0.3).status.stage is RunStage.SAVING
    bench.hear()
    assert bench.view.status.stage is RunStage.SAVED
    saved = bench.store.open(bench.view.status.run_id)
    assert saved.scenario == bench.view.draft.scenario()
    assert bench.store.count() == 1


def test_undo_leads_back_to_a_recording_as_it_was_recorded(bench: Bench) -> None:
    assert bench.view.shown is not None
    recording = open_replay(bench.store, bench.store.save(bench.view.shown.result).id)
    before = bench.view.draft
    bench.view = show_replay(bench.view, recording)
    bench.settle()
    assert bench.view.status.stage is RunStage.REPLAY
    view = bench.do(SetParameter(MASS, 1.4))
    assert view.shown is not None
    assert view.shown.replay is None
    view = bench.do(Undo())
    assert isinstance(view.shown, Shown)
    assert view.shown.replay is recording
    assert view.status.stage is RunStage.REPLAY
    assert bench.do(Undo()).draft == before
    assert bench.view.status.stage is RunStage.PREVIEW
