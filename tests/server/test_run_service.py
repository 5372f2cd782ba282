"""The service that simulates and saves, without HTTP."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from benchmarks.faults.disk import KINDS, FailingFile, growing_files
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.executors.processes import ProcessExecutor
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import StorageFullError
from slipgrasp.recordings.store.store import RecordingStore, StoredRun
from slipgrasp.server.exceptions import RunUnrecordableError, ServiceBusyError
from slipgrasp.server.runs import recovery as run_recovery
from slipgrasp.server.runs.service import RunService
from tests.server.serving import LONG_RUN, patient_settings
from tests.waiting import PATIENCE, wait_until

SHORT = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.05})
LONG = with_values(load_scenario("paper-case-1"), LONG_RUN)
MANY_SAMPLES = with_values(SHORT, {"simulation.duration": 5.0, "simulation.output_rate": 1000.0})
WRITES_BEFORE_THE_FIRST_SAMPLE = 4


@pytest.fixture
def service(tmp_path) -> Iterator[RunService]:
    settings = patient_settings(tmp_path, max_running=1, max_waiting=2)
    service = RunService(RecordingStore(tmp_path), settings)
    yield service
    service.close()


def test_a_run_is_simulated_and_saved(service) -> None:
    result, stored = service.submit(lambda: SHORT).result()
    assert stored is not None and stored.summary["outcome"] == result.outcome
    assert np.array_equal(service.store.open(stored.id).trace.to_rows(), result.trace.to_rows())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("number", [1, 2, 4, 5, 6])
def test_a_disk_that_fails_leaves_service_and_earlier_runs_alone(service, kind, number) -> None:
    _, earlier = service.submit(lambda: SHORT).result()
    before = earlier.path.read_bytes()

    with growing_files(lambda descriptor: FailingFile(descriptor, number, kind)):
        pending = service.submit(lambda: SHORT)
        if number <= WRITES_BEFORE_THE_FIRST_SAMPLE:
            with pytest.raises(RunUnrecordableError, match="free space on the disk"):
                pending.result()
            with pytest.raises(RunUnrecordableError):
                service.look_up(pending.id)
        else:
            result, stored = pending.result()
            assert stored is None
            assert [warning.code for warning in result.warnings] == ["not_saved"]
            assert result.outcome is Outcome.FAILED
            assert result.reason is not None and result.reason.code == "disk"

    assert earlier.path.read_bytes() == before
    _, later = service.submit(lambda: SHORT).result()
    assert later is not None and later.path.read_bytes() == before


def test_what_a_full_disk_has_left_of_a_run_is_recovered_once_there_is_room(
    service, monkeypatch
) -> None:
    monkeypatch.setattr(run_recovery, "PAUSE", 0.01)
    full = threading.Event()
    full.set()
    check_space = service.store.check_space

    def check(incoming: int = 0) -> None:
        if incoming and full.is_set():
            raise StorageFullError("full")
        check_space(incoming)

    monkeypatch.setattr(service.store, "check_space", check)
    service.start()
    with growing_files(lambda descriptor: FailingFile(descriptor, 30, "full")):
        pending = service.submit(lambda: MANY_SAMPLES)
        result, stored = pending.result()
    assert stored is None and result.reason.code == "disk"
    assert service.recovering == [pending.id]
    assert service.look_up(pending.id).summary["reason"]["code"] == "disk"
    assert service.store.count() == 0

    full.clear()
    wait_until(lambda: service.recovering == [])
    kept = service.look_up(pending.id)
    assert isinstance(kept, StoredRun) and kept.summary["outcome"] == Outcome.RECOVERED
    rows, whole = service.store.open(pending.id).trace.to_rows(), result.trace.to_rows()
    assert 0 < len(rows) <= len(whole) and np.array_equal(rows, whole[: len(rows)])
    assert not list(kept.path.parent.glob("*.part"))


def test_a_previewed_run_keeps_its_rows_alone(service: RunService) -> None:
    trace = service.preview(SHORT).trace
    assert service.store.count() == 0
    buffer = trace.times
    while isinstance(buffer.base, np.ndarray):
        buffer = buffer.base
    assert buffer.nbytes == 8 * len(trace) * trace.shape.num_columns


def test_a_preview_stops_when_it_is_asked_to(service) -> None:
    asked = itertools.count()
    long = with_values(LONG, {"controller.control_period": 0.01})
    result = service.preview(long, lambda: next(asked) > 10)
    assert result.outcome is Outcome.STOPPED
    assert 0.0 < result.end_time < LONG.simulation.duration


def test_a_preview_does_not_wait_for_runs(service) -> None:
    service.preview(SHORT)
    waiting = [service.submit(lambda: LONG) for _ in range(2)]
    assert service.preview(SHORT).outcome is Outcome.COMPLETED
    assert [future.done() for future in waiting] == [False, False]
    service.close()
    assert [future.done() for future in waiting] == [True, True]


def test_no_more_runs_wait_than_the_service_was_told(service) -> None:
    for _ in range(3):
        service.submit(lambda: LONG)
    with pytest.raises(ServiceBusyError, match="runs are waiting already"):
        service.submit(lambda: SHORT)


def test_what_is_wrong_with_a_scenario_comes_out_of_the_future_and_frees_the_place(service) -> None:
    def make_nothing():
        raise ScenarioError([])

    for _ in range(5):
        with pytest.raises(ScenarioError):
            service.submit(make_nothing).result()
    wait_for_load(service, running=0)


def test_closing_stops_what_runs_and_keeps_what_it_has(service) -> None:
    future = service.submit(lambda: LONG)
    wait_for_load(service, running=1)
    service.close()
    result, stored = future.result()
    assert result.outcome is Outcome.STOPPED and stored is not None


def test_the_load_counts_running_and_waiting_runs(service) -> None:
    gate = threading.Event()

    def make_when_open():
        gate.wait(PATIENCE)
        return SHORT

    futures = [service.submit(make_when_open) for _ in range(3)]
    wait_for_load(service, running=1)
    assert (service.load.running, service.load.waiting) == (1, 2)
    gate.set()
    assert all(future.result()[1] is not None for future in futures)
    wait_for_load(service, running=0)


def wait_for_load(service: RunService, running: int) -> None:
    wait_until(
        lambda: service.load.running == running and not (running == 0 and service.load.waiting),
        lambda: service.load,
    )


def test_what_a_killed_service_left_is_recovered_behind_and_told_of(service, monkeypatch) -> None:
    _, stored = service.submit(lambda: SHORT).result()
    assert stored is not None
    stored.path.rename(stored.path.with_name(f"{stored.path.name}.part"))
    gate = threading.Event()

    class LaterExecutor(ProcessExecutor):
        def map(self, *arguments: Any, **others: Any) -> Any:
            gate.wait(PATIENCE)
            return super().map(*arguments, **others)

    monkeypatch.setattr(run_recovery, "ProcessExecutor", LaterExecutor)
    service.start()
    assert service.recovering == [stored.id] and not service.is_recovered.is_set()
    with pytest.raises(ServiceBusyError, match="is being recovered"):
        service.look_up(stored.id)
    with pytest.raises(ServiceBusyError):
        service.get(stored.id)
    gate.set()
    assert service.is_recovered.wait(PATIENCE)
    assert service.recovering == [] and service.get(stored.id).id == stored.id
