"""Slips that creep, whose direction is stiff: SciPy's implicit method, the order of ours."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from slipgrasp.core.kernel.numerics.rosenbrock import COUPLING, DIAGONAL, ROS34PW2
from slipgrasp.core.kernel.spatial.flow import LEAST_SPEED
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_scenarios import AtEnds
from tests.references.spatial_plant import State, cone_phase, quaternion_rate
from tests.references.spatial_scenarios import world_of

# Three runs that once ended in the limit of 200 000 steps, most of some 1e-8 s.
CREEPING = (1778, 2119, 3871)
PIECES = 6


@pytest.mark.parametrize("index", CREEPING)
def test_a_slip_that_creeps_moves_as_scipys_radau_does(index):
    scenario = draw_hand_in_space(f"14 {index}", AtEnds)
    result = simulate(with_values(scenario, {"simulation.output_rate": 10_000.0}))
    assert result.outcome is Outcome.COMPLETED
    world, trace = world_of(scenario), result.trace
    pieces = creeping_pieces(trace)
    assert len(pieces) > 100
    for row in pieces[:: len(pieces) // PIECES]:
        start, end = state_at(trace, row), state_at(trace, row + 1)
        step = trace.times[row + 1] - trace.times[row]
        reached = integrate(world, trace, row, start, step)
        # One of some 35 numbers, of which the root mean square is held to 1e-11 m/s.
        assert_allclose(reached.slip_velocity, end.slip_velocity, rtol=2e-6, atol=6e-11)
        assert_allclose(reached.slip - start.slip, end.slip - start.slip, rtol=2e-6, atol=1e-15)
        assert_allclose(reached.velocity, end.velocity, atol=1e-9)
        assert_allclose(reached.position, end.position, atol=1e-13)


def test_in_the_rows_inside_a_slip_that_creeps_it_turns_no_other_way_than_between_them():
    """Its slopes at the ends of an implicit step tell nothing of what is between."""
    trace = simulate(draw_hand_in_space(f"14 {CREEPING[0]}", AtEnds)).trace
    velocity = trace.slip_velocity.reshape(*trace.phase.shape, 2)
    slips = np.linalg.norm(velocity, axis=2) > LEAST_SPEED
    angle = np.degrees(np.arctan2(velocity[:, :, 1], velocity[:, :, 0]))
    turns = (np.diff(angle, axis=0) + 180.0) % 360.0 - 180.0
    later = np.diff(trace.times) > 0.0
    goes_on = (slips[:-2] & slips[1:-1] & slips[2:]) & (later[:-1] & later[1:])[:, None]
    there, back = turns[:-1][goes_on], turns[1:][goes_on]
    beyond = np.minimum(np.abs(there), np.abs(back)) * (there * back < 0.0)
    assert goes_on.sum() > 1000
    assert beyond.max() < 0.5


def creeping_pieces(trace):
    """Rows after which some contact slides slower than 10 um/s until the next row."""
    slips = trace.phase != ContactPhase.STICK
    speeds = np.linalg.norm(trace.slip_velocity.reshape(*slips.shape, 2), axis=2)
    slowest = np.where(slips, speeds, np.inf).min(axis=1)
    creeps = (slowest > 5e-8) & (slowest < 1e-5)
    same = (trace.phase[1:] == trace.phase[:-1]).all(axis=1)
    held = (trace.joint_torque[1:] == trace.joint_torque[:-1]).all(axis=1)
    free = (trace.external_wrench == 0.0).all(axis=1)
    long = np.diff(trace.times) > 9e-5
    return np.flatnonzero(creeps[:-1] & creeps[1:] & same & held & free[:-1] & free[1:] & long)


def state_at(trace, row):
    n = trace.shape.num_contacts
    pose, slip = trace.object_pose[row], trace.slip[row].reshape(n, 2)
    velocity = trace.slip_velocity[row].reshape(n, 2)
    return State(pose[:3], pose[3:], trace.object_velocity[row], slip, velocity)


def integrate(world, trace, row, start, step):
    """The state after ``step`` in the phases of a row, under its torque."""
    n, torques = trace.shape.num_contacts, trace.joint_torque[row].reshape(-1, 3)
    slips = trace.phase[row] != ContactPhase.STICK
    sizes = np.cumsum([3, 4, 6, 2 * n])

    def unpack(y):
        position, quaternion, velocity, slip, slip_velocity = np.split(y, sizes)
        quaternion = quaternion / np.linalg.norm(quaternion)
        return State(
            position, quaternion, velocity, slip.reshape(n, 2), slip_velocity.reshape(n, 2)
        )

    def slope(_t, y):
        state = unpack(y)
        told = [
            state.slip_velocity[i] / np.linalg.norm(state.slip_velocity[i]) if slips[i] else None
            for i in range(n)
        ]
        kin, spin = world.hand.kinematics(state), state.velocity[3:]
        motion = world.hand.solve_all_unknowns(
            kin, world.truth, cone_phase(told), torques, spin=spin
        )
        turning = quaternion_rate(state.quaternion, spin)
        rates = [state.velocity[:3], turning, motion.acceleration[:6], state.slip_velocity.ravel()]
        return np.concatenate([*rates, motion.acceleration[6:]])

    y = np.concatenate([np.ravel(part) for part in start])
    scales = np.concatenate([np.full(sizes[-1], 1e-12), np.full(2 * n, 1e-15)])
    found = solve_ivp(slope, (0.0, step), y, method="Radau", rtol=1e-10, atol=scales)
    assert found.success
    return unpack(found.y[:, -1])


def test_the_implicit_method_has_order_3_whatever_its_jacobian():
    """Order conditions of W-methods; Hairer and Wanner, Solving ODEs II, IV.7."""
    stages = slice(1, 5)
    alpha, b = ROS34PW2["matrix"][stages, stages], ROS34PW2["matrix"][5, stages]
    gamma = np.zeros((4, 4))
    gamma[:, :3] = COUPLING[stages, 1:]
    gamma += DIAGONAL * np.eye(4)
    ones = np.ones(4)
    for weights, conditions in (
        (ones, 1.0),
        (alpha @ ones, 1 / 2),
        (gamma @ ones, 0.0),
        ((alpha @ ones) ** 2, 1 / 3),
        (alpha @ alpha @ ones, 1 / 6),
        (alpha @ gamma @ ones, 0.0),
        (gamma @ alpha @ ones, 0.0),
        (gamma @ gamma @ ones, 0.0),
    ):
        assert b @ weights == pytest.approx(conditions, abs=1e-15)
    # Stiffly accurate; the embedded method has order 2, and not 3.
    assert_allclose(b, alpha[3] + gamma[3], atol=1e-15)
    embedded = b - ROS34PW2["error"][stages]
    assert embedded @ ones == pytest.approx(1.0) and embedded @ alpha @ ones == pytest.approx(0.5)
    assert abs(embedded @ (alpha @ ones) ** 2 - 1 / 3) > 0.01
