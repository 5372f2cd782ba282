"""Bodies on a support and fingers on a rail through the REST interface."""

import pytest

pytestmark = pytest.mark.slow

SLIDE = {"support": {"friction": 0.3}, "motion": {"velocity": [0.5, 0.0, 0.0]}}
SLIDE_PATH = 0.5**2 / (2 * 0.3 * 9.81)  # [m]
PUSHED = [0.0, pytest.approx(0.1, abs=1e-6)]
PUSH = {
    "rail": {"friction": 0.1},
    "finger": {"base": [-1.2, 0.6]},
    "trajectory": {"set_points": [{"time": 0.0, "duration": 1.2, "pose": [0.1]}]},
    "simulation": {"duration": 2.0},
}


@pytest.mark.parametrize(
    ("scenario", "controller", "slip_path", "signal", "absent"),
    [
        (SLIDE, "none", [pytest.approx(SLIDE_PATH, abs=1e-9)], "slip_x_0", "torque"),
        (PUSH, "certainty-equivalence", PUSHED, "torque_0_1", "believed_phase"),
    ],
    ids=["support", "rail"],
)
def test_a_run_is_simulated_listed_and_exported(
    client, scenario, controller, slip_path, signal, absent
):
    answer = client.post("/runs", json={"scenario": scenario})
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert run["metrics"]["slip_path"] == slip_path
    listed = client.get("/runs", params={"controller": controller}).json()["data"]
    assert run["id"] in [each["id"] for each in listed]
    signals = client.get(f"/runs/{run['id']}/signals").json()
    assert signal in str(signals) and absent not in str(signals)


@pytest.mark.parametrize("preset", ["sliding-block", "push-slider"])
def test_control_laws_of_hands_are_refused(client, preset):
    answer = client.post("/runs", json={"scenario": preset, "law": "composite"})
    assert answer.status_code == 422
    assert "needs a hand" in answer.text
