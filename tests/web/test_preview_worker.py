"""The thread that simulates and saves for one session, on the real service."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from core.exceptions import ScenarioError
from core.loading import load_scenario, with_values
from recordings.store import RecordingStore
from server.run_service import RunService
from server.settings import Settings
from web.intents.intent import Intent
from web.intents.runs import RunFinished, RunSaved, SaveFailed
from web.scenario.preview_worker import PreviewWorker
from web.scenario.saved_runs import SavedRuns

CASE = load_scenario("paper-case-1")
# Sampled at 10 kHz for ten minutes: long enough to be given up.
LONG = with_values(CASE, {"simulation.duration": 600.0, "controller.control_period": 1e-4})


@dataclass
class Bench:
    worker: PreviewWorker
    answers: queue.SimpleQueue[Intent]
    store: RecordingStore

    def answer(self) -> Intent:
        return self.answers.get(timeout=60.0)


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    settings = Settings(data_directory=tmp_path / "data")
    store = RecordingStore(settings.data_directory)
    service = RunService(store, settings)
    answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
    worker = PreviewWorker(service, SavedRuns(service), answers.put)
    yield Bench(worker, answers, store)
    worker.close()
    worker.join(10.0)
    service.close()


def test_a_preview_is_answered_and_not_saved(bench: Bench) -> None:
    bench.worker.simulate(1, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    assert (answer.ticket, answer.result.scenario) == (1, CASE)
    assert bench.store.count() == 0


def test_the_latest_request_wins_over_a_long_run(bench: Bench) -> None:
    bench.worker.simulate(1, CASE)
    bench.answer()
    started = time.monotonic()
    bench.worker.simulate(2, LONG)
    time.sleep(0.05)
    bench.worker.simulate(3, CASE)
    answer = bench.answer()
    assert isinstance(answer, RunFinished)
    assert answer.ticket == 3
    assert time.monotonic() - started < 5.0


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
    bench.worker.simulate(1, LONG)
    time.sleep(0.1)
    bench.worker.close()
    bench.worker.join(10.0)
    assert not [t for t in threading.enumerate() if t.name == "preview"]


def test_a_scenario_is_checked_before_it_gets_here() -> None:
    with pytest.raises(ScenarioError):
        with_values(CASE, {"object.mass": -1.0})
