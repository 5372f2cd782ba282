"""Fingers on a rail through the REST interface: runs, parameters, studies."""

import pytest

from tests.server.studying import create, finished

pytestmark = pytest.mark.slow

PUSH = {
    "rail": {"friction": 0.1},
    "finger": {"base": [-1.2, 0.6]},
    "trajectory": {"set_points": [{"time": 0.0, "duration": 1.2, "pose": [0.1]}]},
    "simulation": {"duration": 2.0},
}


def test_a_run_is_simulated_listed_and_exported(client):
    answer = client.post("/runs", json={"scenario": PUSH})
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert run["metrics"]["slip_path"] == [0.0, pytest.approx(0.1, abs=1e-6)]
    listed = client.get("/runs", params={"controller": "certainty-equivalence"}).json()["data"]
    assert run["id"] in [each["id"] for each in listed]
    signals = client.get(f"/runs/{run['id']}/signals").json()
    assert "torque_0_1" in str(signals) and "believed_phase" not in str(signals)


def test_other_control_laws_are_refused(client):
    answer = client.post("/runs", json={"scenario": "push-slider", "law": "composite"})
    assert answer.status_code == 422
    assert "needs a hand" in answer.text


def test_parameters_are_described(client):
    found = client.get("/parameters", params={"preset": "push-slider"}).json()["data"]
    keys = {each["key"] for each in found}
    assert {"rail.friction", "finger.angle", "controller.grip_force"} <= keys
    assert not any(key.startswith(("fingers", "support", "pulses")) for key in keys)


def test_a_study_varies_the_grip_force(studies):
    study = create(
        studies,
        {
            "base": "drag-slider",
            "sampling": {"method": "latin-hypercube", "runs": 4, "seed": 1},
            "vary": {
                "controller.grip_force": {"min": 12.0, "max": 20.0},
                "object.mass": {"min": 0.5, "max": 1.0},
            },
        },
    )
    assert finished(studies, study)["state"] == "completed"
