"""Contacts exactly on a boundary: of their friction cone, or without any force."""

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import Outcome

# With `grip_safety` 1 the law asks for forces exactly on the cones, which rounding then leaves on
# either side of them.
ON_THE_CONE = {
    "fingers": [
        {"base": (0.4, -0.2), "face": "left"},
        {"base": (3.0, -0.2), "face": "right"},
    ],
    "trajectory": {
        "kind": "table",
        "start": (1.466, 0.366, -0.08694442305108657),
        "table": [(0.0, 1.466, 0.366, -0.08694442305108657), (0.1, 1.0, 0.4, -0.08)],
    },
    "controller": {"kind": "composite", "grip_safety": 1.0},
    "estimates": [{"parameter": "object.inertia", "initial": 0.015}],
    "simulation": {"duration": 0.2},
}


def test_a_contact_whose_force_is_on_its_cone_sticks_or_slips():
    run = simulate(scenario_from_mapping(ON_THE_CONE))

    assert run.outcome is not Outcome.INCONSISTENT
    assert run.end_time > 0.061


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_a_contact_that_is_asked_for_no_force_opens(period):
    values = {
        "simulation.gravity": 0.0,
        "trajectory.acceleration": (0.0, 0.0, 0.0),
        "controller.control_period": period,
        "controller.minimum_normal_force": 0.0,
    }

    run = simulate(with_values(load_scenario("paper-case-1"), values))

    assert (run.outcome, run.end_time) == (Outcome.SEPARATED, 0.0)
    assert run.trace.normal_force[-1] == pytest.approx([0.0, 0.0], abs=1e-12)
