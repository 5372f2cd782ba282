"""Pages with equal scenarios share one run."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.workers.live_runs import LiveRun, LiveRuns
from tests.server.serving import patient_settings


@pytest.fixture
def service(tmp_path: Path) -> Iterator[RunService]:
    settings = patient_settings(tmp_path / "data")
    service = RunService(RecordingStore(settings.data_directory), settings)
    yield service
    service.close()


def simulate(live: LiveRuns, scenario: Scenario) -> LiveRun:
    return live.simulate(scenario, lambda: False)


def test_equal_scenarios_share_one_run_and_its_computing_time(service: RunService) -> None:
    live = LiveRuns(service)
    first = simulate(live, load_scenario("paper-case-1"))
    held = service.memory.held
    second = simulate(live, load_scenario("paper-case-1"))
    assert second.result is first.result
    assert second.elapsed == first.elapsed
    assert service.memory.held == held


def test_a_run_is_forgotten_with_its_last_page(service: RunService) -> None:
    live, case = LiveRuns(service), load_scenario("paper-case-1")
    first = simulate(live, case)
    assert service.memory.held > 0
    del first
    gc.collect()
    assert service.memory.held == 0


def test_pages_that_simulate_at_the_same_time_share_the_run_of_the_first(
    service: RunService, monkeypatch: pytest.MonkeyPatch
) -> None:
    live, case, preview = LiveRuns(service), load_scenario("paper-case-1"), service.preview
    others: list[LiveRun] = []

    def overtaken(scenario: Scenario, should_stop: object) -> RunResult:
        monkeypatch.setattr(service, "preview", preview)
        others.append(simulate(live, scenario))
        return preview(scenario)

    monkeypatch.setattr(service, "preview", overtaken)
    assert simulate(live, case).result is others[0].result


def test_a_stopped_run_is_not_shared(service: RunService) -> None:
    live = LiveRuns(service)
    case = with_values(
        load_scenario("paper-case-1"), {"simulation.max_step": 1e-5, "simulation.duration": 0.05}
    )
    stopped = live.simulate(case, lambda: True)
    assert stopped.result.outcome is Outcome.STOPPED
    assert simulate(live, case).result is not stopped.result
