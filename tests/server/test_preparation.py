"""What a service says while the simulation is compiled at its first start on a machine."""

from __future__ import annotations

import threading

from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.preparation import COMPILING_SECONDS, Preparation
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.view import RunStage, RunStatus
from slipgrasp.web.panels.outcome_panel import outcome_html
from tests.server.serving import patient_settings, serve

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


class Compiler:
    """One that is watched at times that the test chooses."""

    def __init__(self) -> None:
        self.share, self.now, self.used = 0.0, 100.0, 7.0
        self.preparation = Preparation(lambda: self.share, lambda: self.now, lambda: self.used)


def test_the_time_to_go_is_reckoned_from_the_pace_so_far() -> None:
    compiler = Compiler()
    assert compiler.preparation.look() == (0.0, None)
    compiler.now += 30.0
    compiler.share = 0.25
    assert compiler.preparation.look() == (0.25, 90.0)
    assert compiler.preparation.words() == "25% done, about 2 min to go"
    compiler.share = 0.75
    assert compiler.preparation.words() == "75% done, about 10 s to go"


def test_before_anything_is_compiled_no_time_is_made_up() -> None:
    compiler = Compiler()
    compiler.now += 300.0
    assert compiler.preparation.look() == (0.0, None)
    told = "0% done, half a minute or more to go, longer on a busy machine"
    assert compiler.preparation.words() == told


def test_before_the_first_unit_it_is_reckoned_from_the_processor_that_others_leave() -> None:
    compiler = Compiler()
    compiler.preparation.look()
    compiler.now, compiler.used = compiler.now + 360.0, compiler.used + 4.5
    assert compiler.preparation.look() == (0.0, 360.0 * 9)
    assert compiler.preparation.words() == "0% done, about 54 min to go"
    compiler.used += COMPILING_SECONDS
    assert compiler.preparation.look() == (0.0, None)


def test_what_is_compiled_later_has_a_pace_of_its_own() -> None:
    compiler = Compiler()
    compiler.share = 1.0
    assert compiler.preparation.look() == (1.0, 0.0) and compiler.preparation.words() == ""
    compiler.share, compiler.now = 0.5, 1e6
    compiler.preparation.look()
    compiler.share, compiler.now = 0.6, 1e6 + 10.0
    assert compiler.preparation.words() == "60% done, about 40 s to go"


def test_while_it_is_compiled_readiness_health_runs_and_the_page_say_how_long(
    tmp_path, monkeypatch
) -> None:
    compiler, compiled = Compiler(), threading.Event()
    compiler.preparation.look()
    compiler.share, compiler.now = 0.2, 700.0
    monkeypatch.setattr("slipgrasp.server.runs.service.Preparation", lambda: compiler.preparation)
    monkeypatch.setattr("slipgrasp.server.runs.service.prepare_kernel", compiled.wait)
    words = "20% done, about 40 min to go"
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        try:
            ready, health = client.get("/ready"), client.get("/health").json()
            run = client.post("/runs", json=SHORT, headers={"Prefer": "respond-async"}).json()
        finally:
            compiler.share = 1.0
            compiled.set()
        last = client.get(f"/runs/{run['id']}", headers={"Prefer": "wait=60"}).json()
    assert ready.status_code == 503
    told = f"the simulation is still being compiled for this machine, once: {words}"
    assert told in ready.json()["detail"]
    assert (health["kernel_progress"], health["kernel_seconds_left"]) == (0.2, 2400.0)
    assert run["compiling"] == words and last["outcome"] == "completed"
    assert words in outcome_html(RunStatus(RunStage.COMPILING, (words,)), None)


def test_a_simulation_that_is_only_loaded_is_not_called_compiled(tmp_path) -> None:
    service = RunService(RecordingStore(tmp_path), patient_settings(tmp_path))
    assert "the simulation is being loaded" in service.obstacles()
    service.submit(lambda: load_scenario("paper-case-1")).result()
    assert service.obstacles() == []
    service.close()
