"""A hand that differs from what its controller believes: friction in the joints, wrong lengths."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_closed_loop_identities import state_of
from tests.core.test_composite import at_ticks
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State

RUBBING = {
    **{f"fingers.{i}.joint_damping": 0.3 for i in range(2)},
    "fingers.0.joint_friction": 0.5,
}


@pytest.mark.parametrize("name", ["paper-case-1", "composite-case-2"])
def test_the_ledger_of_energy_closes_with_joints_that_rub(name):
    scenario = with_values(load_scenario(name), {**RUBBING, "simulation.duration": 0.5})
    trace = simulate(scenario).trace
    assert np.abs(trace.energy_residual).max() < 1e-8
    stuck = (trace.phase == 0).all(axis=1)
    moving = stuck[1:] & stuck[:-1] & (np.diff(trace.times) > 1e-4)
    assert (np.diff(trace.dissipated_energy)[moving] > 0.0).all()


def test_rubbing_joints_take_their_torque_from_every_row_of_the_trace():
    scenario = with_values(load_scenario("paper-case-2"), {**RUBBING, "simulation.duration": 0.3})
    trace, loop = simulate(scenario).trace, ClosedLoop.from_scenario(scenario)
    assert np.any(trace.phase != 0)
    for k in range(0, len(trace.times), 7):
        state = state_of(trace, k)
        motion = loop.solve_plant(state, tuple(trace.phase[k]), trace.joint_torque[k])
        np.testing.assert_allclose(motion.acceleration[:3], trace.object_acceleration[k], atol=1e-9)
        np.testing.assert_allclose(motion.forces[:, 1], trace.normal_force[k], atol=1e-8)


def test_a_law_that_mistakes_its_lengths_commands_by_the_jacobian_it_believes_in():
    """PD control with a grip at rest, at the start: all forces are known in closed form."""
    ratio, grip, mass = 1.1, 30.0, 0.5
    values = {
        "controller.kind": "pd-gravity",
        "controller.link_length_ratio": ratio,
        "controller.grip_force": grip,
        "simulation.duration": 0.01,
    }
    scenario = with_values(load_scenario("composite-case-2"), values)
    trace, loop = simulate(scenario).trace, ClosedLoop.from_scenario(scenario)
    first = at_ticks(trace)[0]
    assert np.all(trace.tracking_error[first] == 0.0)
    kin = loop.hand.kinematics(
        State(trace.object_pose[first], np.zeros(3), np.zeros(2), np.zeros(2))
    )
    desired = loop.trajectory.desired(0.0)
    for i, finger in enumerate(loop.hand.fingers):
        long = finger._replace(lengths=ratio * finger.lengths, centres=ratio * finger.centres)
        lift = 0.5 * mass * (scenario.controller.velocity_gain * desired[1][:2] + [0.0, 9.81])
        force = grip * kin.frames[i][:, 1] + lift
        weight = long.bias(kin.q[i], np.zeros(2), loop.truth.link_masses[i], 9.81)
        expected = long.jacobian(kin.q[i]).T @ force + weight
        np.testing.assert_allclose(trace.joint_torque[first, 2 * i : 2 * i + 2], expected)
