"""The thread that simulates and saves for one session, on the real service."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.runs import RunFinished, RunSaved, SaveFailed
from slipgrasp.web.workers import live_runs
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.preview_worker import PreviewWorker
from slipgrasp.web.workers.saved_runs import SavedRuns
from tests.server.serving import patient_settings
from tests.waiting import PATIENCE

CASE = load_scenario("paper-case-1")
# Ten minutes in steps of 10 µs: long enough to be given up.
LONG = with_values(CASE, {"simulation.duration": 600.0, "simulation.max_step": 1e-5})


@dataclass
class Bench:
    worker: PreviewWorker
    answers: queue.SimpleQueue[Intent]
    store: RecordingStore
    is_at_it: threading.Event

    def begin(self, ticket: int, scenario: Scenario) -> None:
        """Asks for a run, and waits until it is simulated."""
        self.is_at_it.clear()
        self.worker.simulate(ticket, scenario)
        assert self.is_at_it.wait(PATIENCE)

    def answer(self) -> Intent:
        return self.answers.get(timeout=PATIENCE)


@pytest.fixture
def service(tmp_path: Path) -> RunService:
    settings = patient_settings(tmp_path / "data")
    return RunService(RecordingStore(settings.data_directory), settings)


@pytest.fixture
def bench(service: RunService, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
    worker = PreviewWorker(LiveRuns(service), SavedRuns(service), answers.put)
    bench = Bench(worker, answers, service.store, threading.Event())
    preview = service.preview

    def watched(scenario: Scenario, should_stop: Callable[[], bool]) -> RunResult:
        bench.is_at_it.set()
        return preview(scenario, should_stop)

    monkeypatch.setattr(service, "preview", watched)
    yield bench
    worker.close()
    worker.join(PATIENCE)
    service.close()


def test_a_preview_is_answered_and_not_saved(bench: Bench) -> None:
    bench.worker.simulate(1, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    assert (answer.ticket, answer.result.scenario) == (1, CASE)
    assert bench.store.count() == 0


def test_what_is_told_as_computing_leaves_compiling_out(
    bench: Bench, service: RunService, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(service, "prepare", lambda: vars(clock).update(now=30.0))
    monkeypatch.setattr(live_runs, "time", SimpleNamespace(monotonic=lambda: clock.now))
    bench.worker.simulate(1, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    assert answer.elapsed == 0.0


def test_the_latest_request_wins_over_a_long_run(bench: Bench) -> None:
    bench.worker.simulate(1, CASE)
    bench.answer()
    bench.begin(2, LONG)
    bench.worker.simulate(3, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    assert answer.ticket == 3


def test_a_burst_of_requests_ends_with_the_last_one(bench: Bench) -> None:
    for ticket in range(1, 30):
        bench.worker.simulate(ticket, with_values(CASE, {"object.mass": 1.0 + 0.01 * ticket}))
    ticket = 0
    while ticket < 29:
        answer = bench.answer()
        assert isinstance(answer, RunFinished)
        assert answer.ticket > ticket
        ticket = answer.ticket


def test_equal_runs_are_kept_once(bench: Bench) -> None:
    bench.worker.simulate(1, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    ids = []
    for ticket in (1, 2):
        bench.worker.save(ticket, answer.result)
        saved = bench.answer()
        assert isinstance(saved, RunSaved)
        ids.append(saved.stored.id)
    assert ids[0] == ids[1]
    bench.store.delete(ids[0])
    bench.worker.save(3, answer.result)
    again = bench.answer()
    assert isinstance(again, RunSaved)
    assert again.stored.id != ids[0]


def test_a_disk_that_refuses_is_told(bench: Bench, tmp_path: Path) -> None:
    bench.worker.simulate(1, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    (tmp_path / "data").write_text("in the way")
    bench.worker.save(1, answer.result)
    failed = bench.answer()
    assert isinstance(failed, SaveFailed)
    assert failed.message


def test_closing_gives_up_what_goes_on_and_ends_the_thread(bench: Bench) -> None:
    bench.begin(1, LONG)
    bench.worker.close()
    bench.worker.join(PATIENCE)
    assert "preview" not in {thread.name for thread in threading.enumerate()}
    assert bench.answers.empty()
