"""A request names a law that the service was started with; it never brings code or a path.

What such a law does costs the service nothing but that run.
"""

import json
from pathlib import Path

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.custom_laws import custom_law, forget
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import load_law, register_law
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.server.rough_law import NO_ANSWER, NOTHING, SEGMENTATION_FAULT
from tests.server.running import AT_ONCE, run_to_end, stop_to_end


class Offered:
    """Commands nothing."""

    def command(self, seen, memory, out):
        pass


@pytest.fixture
def _offered():
    register_law(Offered)
    yield
    forget("offered")


@pytest.mark.parametrize(
    "kind",
    ["nobody-knows", "outside", "law.py:Carry", "/etc/passwd", "class X: pass"],
)
def test_a_request_with_code_a_path_or_an_unknown_name_is_refused(client, kind):
    asked = {"scenario": "composite-case-2", "set": {"controller.kind": kind}}
    for body in (asked, {"scenario": "composite-case-2", "law": kind}):
        answer = client.post("/runs", json=body)
        assert answer.status_code == 422
        assert "controller.kind" in answer.text
    study = {"base": "composite-case-2", "vary": {"controller.kind": {"values": [kind]}}}
    assert client.post("/studies", json=study).status_code == 422
    assert client.post("/studies", json={**study, "law": kind}).status_code == 422


@pytest.mark.parametrize("preset", ["composite-case-2", "trifinger"])
def test_a_law_that_is_offered_runs_under_its_name(client, _offered, preset):
    for asked in ({"law": "offered"}, {"set": {"controller.kind": "offered"}}):
        asked["scenario"] = preset
        run = run_to_end(client, asked)
        assert run["outcome"] == "separated" and run["law"]["name"] == "offered"


def test_a_law_comes_with_the_settings_that_it_is_meant_for_and_what_is_set_wins(client):
    asked = {"scenario": "paper-case-2", "law": "composite", "set": {"controller.grip_safety": 1.6}}
    made = run_to_end(client, asked)
    assert made["law"] is None and made["controller"] == "composite"
    here = with_values(with_law(load_scenario("paper-case-2"), "composite"), asked["set"])
    assert made["metrics"] == json.loads(json.dumps(simulate(here).summary()["metrics"]))


def test_the_parameters_of_a_law_that_is_offered_are_listed(client, _rough):
    def listed(**asked):
        return {each["key"] for each in client.get("/parameters", params=asked).json()["data"]}

    assert listed(law="rough") - listed() == {"controller.parameters.fault"}
    answer = client.get("/parameters", params={"law": "nobody-knows"})
    assert answer.status_code == 422 and "nobody-knows" in answer.json()["errors"][0]["message"]


def test_a_study_names_a_law_that_is_offered(client, _offered):
    asked = {"base": "composite-case-2", "law": "offered", "recordings": "none"}
    vary = {"object.mass": {"min": 0.8, "max": 1.2, "count": 2}}
    answer = client.post("/studies", json={**asked, "vary": vary})
    assert answer.status_code == 202, answer.text
    refused = client.post("/studies", json={**asked, "law": ["offered"], "vary": vary})
    assert refused.status_code == 422


@pytest.fixture
def _rough():
    law = load_law(f"{Path(__file__).with_name('rough_law.py')}:Rough")
    yield
    forget(law.name)


def _asking(fault: int) -> dict[str, object]:
    return {"scenario": "composite-case-2", "set": _rough_values(fault)}


def _rough_values(fault: int) -> dict[str, object]:
    return {"controller.kind": "rough", "controller.parameters.fault": fault}


def test_a_law_that_breaks_its_process_costs_one_run_with_its_reason(client, _rough):
    broken = run_to_end(client, _asking(SEGMENTATION_FAULT))
    assert broken["outcome"] == "failed" and broken["reason"]["code"] == "worker_died"
    assert "SIGSEGV" in broken["reason"]["message"] and "'rough'" in broken["reason"]["message"]
    whole = run_to_end(client, _asking(NOTHING))
    law = custom_law("rough").identity
    assert whole["law"] == {"name": law.name, "version": law.version, "digest": law.digest}
    assert client.get(f"/runs/{whole['id']}").json()["law"] == whole["law"]
    here = simulate(with_values(load_scenario("composite-case-2"), _rough_values(NOTHING)))
    assert whole["metrics"] == json.loads(json.dumps(here.summary()["metrics"]))


def test_a_law_that_never_answers_can_be_stopped(client, _rough):
    run_id = client.post("/runs", json=_asking(NO_ANSWER), headers=AT_ONCE).json()["id"]
    stopped = stop_to_end(client, run_id)
    assert stopped["outcome"] == "failed" and stopped["reason"]["code"] == "worker_died"
    assert "did not finish within 1 s" in stopped["reason"]["message"]
