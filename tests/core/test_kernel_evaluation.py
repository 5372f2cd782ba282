"""The compiled kernel at random states against the references and against its own identities.

Every combination of phases of 2, 3 and 4 fingers, every set of unknowns.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values
from tests.core.drawn_chains import with_chains
from tests.each_case import each_case
from tests.phases import PHASES
from tests.references.closed_loop import ClosedLoop, Evaluation
from tests.references.controller import regressor
from tests.references.hand import State
from tests.references.hands import (
    UNKNOWN_KINDS,
    general_gains,
    random_estimates,
    random_scenario,
    random_state,
)
from tests.state_evaluation import StateEvaluation, evaluate_state

pytestmark = pytest.mark.slow

TIMES = (0.4, 1.3, 3.2, 4.5)  # one in each piece of the desired motion


class Point(NamedTuple):
    """One random state, seen by the kernel and by the reference."""

    scenario: Scenario
    loop: ClosedLoop
    t: float
    state: State
    phase: tuple[int, ...]
    estimates: np.ndarray
    kernel: StateEvaluation
    reference: Evaluation


@cache
def point(phase, kind, torque_seed=None, general=False, chains=False):
    rng = np.random.default_rng([UNKNOWN_KINDS.index(kind), *(g + 1 for g in phase)])
    scenario = random_scenario(rng, len(phase), kind)
    if general:
        scenario = with_values(scenario, general_gains(rng, 3, len(phase)))
    if chains:
        scenario = with_chains(scenario, phase, 1.0, free=True)
    loop = ClosedLoop.from_scenario(scenario)
    state = random_state(rng, scenario, phase)
    estimates = random_estimates(rng, scenario)
    t = float(rng.choice(TIMES))
    torque = None if torque_seed is None else given_torque(torque_seed, len(phase))
    kernel = evaluate_state(scenario, t, *state, phase, estimates, torque=torque)
    desired = loop.trajectory.desired(t)
    reference = loop.evaluate(state, phase, estimates, desired, torques=torque)
    return Point(scenario, loop, t, state, phase, estimates, kernel, reference)


def given_torque(seed, n):
    return np.random.default_rng(seed).uniform(-20.0, 20.0, 2 * n)


def assert_close(actual, expected, tolerance=1e-9):
    """Agreement relative to the largest entry."""
    scale = max(1.0, float(np.max(np.abs(expected), initial=0.0)))
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * scale)


each_phase = each_case("phase", PHASES)


@each_phase
def test_kinematics_agree(phase):
    p = point(phase, "nothing")
    kin = p.reference.kin
    turns = (p.kernel.joint_positions - kin.q) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    assert_close(p.kernel.joint_velocities, kin.qd, 1e-11)
    assert_close(p.kernel.finger_jacobians, kin.jacobians, 1e-12)
    assert_close(p.kernel.contact_frames, kin.frames, 1e-13)
    assert_close(p.kernel.grasp_matrix, kin.W, 1e-13)


@each_phase
@pytest.mark.parametrize("kind", UNKNOWN_KINDS)
def test_reduced_form_and_its_estimate_agree(phase, kind):
    p = point(phase, kind)
    kin, hand = p.reference.kin, p.loop.hand
    true = hand.reduced_form(kin, p.loop.truth, phase)
    assert_close(p.kernel.reduced_inertia, true.M)
    assert_close(p.kernel.reduced_bias, true.h)
    assert_close(p.kernel.reduced_input, true.B)
    believed = hand.reduced_form(kin, p.loop.unknowns.fill(p.estimates), phase)
    assert_close(p.kernel.estimated_reduced_inertia, believed.M)
    assert_close(p.kernel.estimated_reduced_bias, believed.h)


@each_phase
@pytest.mark.parametrize("kind", UNKNOWN_KINDS)
def test_law_motion_and_adaptation_agree(phase, kind):
    assert_that_laws_agree(point(phase, kind), phase)


@each_phase
def test_law_and_adaptation_agree_with_gains_of_the_slips_and_a_full_q(phase):
    assert_that_laws_agree(point(phase, "friction", general=True), phase)


@each_phase
@pytest.mark.parametrize("kind", UNKNOWN_KINDS)
def test_law_motion_and_adaptation_of_chains_agree(phase, kind):
    p = point(phase, kind, chains=True)
    assert_close(p.kernel.joint_positions, p.reference.kin.q)
    assert_close(p.kernel.finger_jacobians, p.reference.kin.jacobians)
    assert_that_laws_agree(p, phase)


def assert_that_laws_agree(p, phase):
    """Torque, motion, adaptation and V are those of the reference."""
    motion = p.reference.motion
    assert_close(p.kernel.torques, p.reference.torques, 1e-8)
    assert_close(p.kernel.acceleration, motion.acceleration, 1e-8)
    assert_close(p.kernel.joint_accelerations, motion.joint_accelerations, 1e-8)
    assert_close(p.kernel.contact_forces, motion.forces, 1e-8)
    desired = p.loop.trajectory.desired(p.t)
    rates = p.loop.estimate_rates(
        p.reference.kin, p.state, phase, p.estimates, desired, motion.acceleration
    )
    assert_close(p.kernel.estimate_rates, rates, 1e-7)
    truth = [true_value(p.scenario, key) for key in p.loop.unknowns.keys]
    value = p.loop.law.lyapunov_value(p.state, phase, desired, np.array(truth) - p.estimates)
    assert p.kernel.lyapunov_value == pytest.approx(value, rel=1e-10)


def true_value(scenario, key):
    node = scenario
    for word in key.split("."):
        node = node[int(word)] if word.isdigit() else getattr(node, word)
    return node


@each_phase
def test_motion_under_a_given_torque_agrees(phase):
    p = point(phase, "masses", torque_seed=11)
    assert_close(p.kernel.torques, given_torque(11, len(phase)), 1e-15)
    assert_close(p.kernel.acceleration, p.reference.motion.acceleration)
    assert_close(p.kernel.contact_forces, p.reference.motion.forces)


@each_phase
@pytest.mark.parametrize("kind", UNKNOWN_KINDS)
def test_regressor_agrees_and_reproduces_the_left_hand_side(phase, kind):
    """Identity 4: U phi + known = M xdd + h, for the true parameters and for the estimates."""
    p = point(phase, kind)
    k = p.kernel
    U, known = regressor(p.loop.hand, p.reference.kin, p.loop.unknowns, phase, k.acceleration)
    assert_close(k.regressor, U)
    assert_close(k.known, known)
    truth = np.array([true_value(p.scenario, key) for key in p.loop.unknowns.keys])
    assert_close(k.regressor @ truth + k.known, k.reduced_inertia @ k.acceleration + k.reduced_bias)
    believed = k.estimated_reduced_inertia @ k.acceleration + k.estimated_reduced_bias
    assert_close(k.regressor @ p.estimates + k.known, believed)


@each_phase
def test_virtual_work_closes(phase):
    """Identity 1: W_i = -A_o,i^T C_i, with A_o = -[I  S r] from the fingertips."""
    p = point(phase, "nothing")
    tips = p.loop.hand.tip_positions(p.state.pose, p.state.slip) - p.state.pose[:2]
    for i, (x, y) in enumerate(tips):
        A_o = -np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
        W = p.kernel.grasp_matrix[:, 2 * i : 2 * i + 2]
        np.testing.assert_allclose(W, -A_o.T @ p.kernel.contact_frames[i], atol=1e-14)


@each_phase
def test_motion_satisfies_the_four_blocks_of_the_equations(phase):
    """Identity 2: fingers, object, closure and friction, each to rounding."""
    p = point(phase, "masses")
    k, kin, hand, truth = p.kernel, p.reference.kin, p.loop.hand, p.loop.truth
    qdd, forces = k.joint_accelerations.ravel(), k.contact_forces.ravel()
    M, h = hand.finger_dynamics(kin, truth)
    assert_close(M @ qdd + h, k.torques - kin.J.T @ forces)
    M_o, h_o = hand.object_dynamics(truth)
    assert_close(M_o @ k.acceleration[:3] + h_o, kin.W @ forces)
    assert_close(kin.A_q @ qdd + kin.A_o @ k.acceleration[:3] + kin.A_s @ k.acceleration[3:], kin.b)
    for gamma, mu, acceleration, (F_x, F_n) in zip(
        phase, truth.friction, k.acceleration[3:], k.contact_forces, strict=True
    ):
        if gamma == 0:
            assert acceleration == 0.0
        else:
            assert F_x == pytest.approx(-gamma * mu * F_n, rel=1e-9, abs=1e-9)
    assert_close(k.reduced_inertia @ k.acceleration + k.reduced_bias, k.reduced_input @ k.torques)


@each_phase
def test_energies_agree(phase):
    p = point(phase, "object")
    kin, hand, truth = p.reference.kin, p.loop.hand, p.loop.truth
    kinetic = hand.kinetic_energy(p.state, kin, truth)
    assert p.kernel.kinetic_energy == pytest.approx(kinetic, rel=1e-12)
    potential = hand.potential_energy(p.state, kin, truth)
    assert p.kernel.potential_energy == pytest.approx(potential, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_jacobian_is_the_derivative_of_the_fingertip(n):
    """Identity 1: J and its rate by finite differences along a motion."""
    p = point((1,) * n, "nothing")
    dt = 1e-6

    def shifted(step):
        moved = p.state._replace(
            pose=p.state.pose + step * p.state.velocity,
            slip=p.state.slip + step * p.state.slip_velocity,
        )
        return evaluate_state(p.scenario, p.t, *moved, p.phase, p.estimates)

    ahead, behind = shifted(dt), shifted(-dt)
    qd = (ahead.joint_positions - behind.joint_positions) / (2.0 * dt)
    np.testing.assert_allclose(qd, p.kernel.joint_velocities, atol=1e-7)
    J_rate = (ahead.finger_jacobians - behind.finger_jacobians) / (2.0 * dt)
    for i, finger in enumerate(p.loop.hand.fingers):
        expected = finger.jacobian_rate_times_velocity(p.reference.kin.q[i], qd[i])
        np.testing.assert_allclose(J_rate[i] @ qd[i], expected, atol=1e-6)
