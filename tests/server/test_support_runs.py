"""Bodies on a support through the REST interface: runs, batches, parameters, studies."""

import pytest

from tests.server.studying import create, finished

pytestmark = pytest.mark.slow

SLIDE = {"support": {"friction": 0.3}, "motion": {"velocity": [0.5, 0.0, 0.0]}}


def test_a_run_is_simulated_listed_and_exported(client):
    answer = client.post("/runs", json={"scenario": SLIDE})
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert run["metrics"]["slip_path"] == [pytest.approx(0.5**2 / (2 * 0.3 * 9.81), abs=1e-9)]
    listed = client.get("/runs", params={"controller": "none"}).json()["data"]
    assert run["id"] in [each["id"] for each in listed]
    signals = client.get(f"/runs/{run['id']}/signals").json()
    assert "slip_x_0" in str(signals) and "torque" not in str(signals)


def test_a_control_law_is_refused(client):
    answer = client.post("/runs", json={"scenario": "sliding-block", "law": "composite"})
    assert answer.status_code == 422
    assert "needs a hand" in answer.text


def test_parameters_are_described(client):
    found = client.get("/parameters", params={"preset": "sliding-block"}).json()["data"]
    keys = {each["key"] for each in found}
    assert {"support.friction", "support.radius", "motion.velocity.0", "pulses.0.force.0"} <= keys
    assert not any(key.startswith(("fingers", "controller")) for key in keys)


def test_a_study_varies_friction_and_mass(studies):
    study = create(
        studies,
        {
            "base": "sliding-block",
            "sampling": {"method": "latin-hypercube", "runs": 6, "seed": 1},
            "vary": {
                "support.friction": {"min": 0.1, "max": 0.5},
                "object.mass": {"min": 0.2, "max": 2.0},
            },
        },
    )
    done = finished(studies, study)
    assert done["state"] == "completed"
