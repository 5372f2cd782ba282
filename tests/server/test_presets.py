"""What the REST interface says of a preset of each kind is what the run itself says."""

import json

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario

PRESETS = ("paper-case-1", "composite-case-2-noisy", "spatial-prism", "parallel-gripper")
PRESETS += ("trifinger", "spinning-slide", "push-slider")


@pytest.mark.slow
@pytest.mark.parametrize("preset", PRESETS)
def test_a_run_of_a_preset_is_answered_and_listed_as_it_went(client, preset):
    run = client.post("/runs", json={"scenario": preset}).json()

    told = json.loads(json.dumps(simulate(load_scenario(preset)).summary()))
    assert run["outcome"] == told["outcome"] == "completed"
    assert {key: run[key] for key in told if key != "name"} == {
        key: value for key, value in told.items() if key != "name"
    }
    assert client.get(f"/runs/{run['id']}").json() == run
    listed = client.get("/runs", params={"preset": preset, "outcome": "completed"}).json()
    assert run in listed["data"]
