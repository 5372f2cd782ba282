"""The compiled kernel against Pinocchio: fingers built from the scenario as a URDF.

Random hands of 2, 3 and 4 fingers: unequal links, centres of mass away from the middle, both
elbow branches. Both sides compute in double precision by unlike algorithms; the tolerance of
1e-10, relative to the largest entry, leaves room for the conditioning of the inversions that
recover a finger's own terms from the motion of the whole hand.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario
from tests.each_case import each_case
from tests.phases import PHASES
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State, friction_rows
from tests.references.hands import random_estimates, random_scenario, random_state
from tests.references.pinocchio_hand import FingerTerms, PinocchioHand
from tests.state_evaluation import StateEvaluation, evaluate_state

pytestmark = pytest.mark.slow

HANDS = [(n, seed) for n in (2, 3, 4) for seed in range(6)]
TOLERANCE = 1e-10


class Point(NamedTuple):
    """A random state of a random hand."""

    scenario: Scenario
    state: State
    phase: tuple[int, ...]
    estimates: np.ndarray
    hand: PinocchioHand
    kernel: StateEvaluation
    torques: np.ndarray
    terms: FingerTerms


@cache
def point(phase, seed):
    rng = np.random.default_rng([seed, *(gamma + 2 for gamma in phase)])
    scenario = random_scenario(rng, len(phase), "masses")
    state, estimates = random_state(rng, scenario, phase), random_estimates(rng, scenario)
    torques = rng.uniform(-20.0, 20.0, 2 * len(phase))
    kernel = evaluate_state(scenario, 0.4, *state, phase, estimates, torque=torques)
    hand = PinocchioHand(scenario)
    terms = hand.terms(kernel.joint_positions, kernel.joint_velocities)
    return Point(scenario, state, phase, estimates, hand, kernel, torques, terms)


def hand_point(n, seed):
    """A hand in a phase drawn at random."""
    phase = np.random.default_rng([n, seed]).integers(-1, 2, n)
    return point(tuple(int(gamma) for gamma in phase), seed)


def assert_close(actual, expected, tolerance=TOLERANCE):
    """Agreement relative to the largest entry."""
    scale = max(1.0, float(np.max(np.abs(expected))))
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * scale)


each_hand = pytest.mark.parametrize(("n", "seed"), HANDS)
each_phase = each_case("phase", PHASES)


def test_random_hands_have_both_elbows_and_no_two_links_alike():
    fingers = [f for n, seed in HANDS for f in hand_point(n, seed).scenario.fingers]
    assert {f.elbow for f in fingers} == {"up", "down"}
    assert len({length for f in fingers for length in f.link_lengths}) == 2 * len(fingers)
    assert len({c for f in fingers for c in f.link_centre_fractions}) == 2 * len(fingers)


@each_hand
def test_fingertips_and_their_jacobians_are_pinocchio_s(n, seed):
    p = hand_point(n, seed)
    tips = ClosedLoop.from_scenario(p.scenario).hand.tip_positions(p.state.pose, p.state.slip)
    assert_close(tips, p.terms.tips)
    assert_close(p.kernel.finger_jacobians, p.terms.jacobians)


@each_hand
def test_fingertips_accelerate_as_pinocchio_says(n, seed):
    """J q'' + J' q' of each finger is the acceleration of the object's point under the tip."""
    p = hand_point(n, seed)
    k, spin, turn = p.kernel, p.state.velocity[2], np.array([[0.0, -1.0], [1.0, 0.0]])
    for i, arm in enumerate(p.terms.tips - p.state.pose[:2]):
        tangent = -k.contact_frames[i][:, 0]
        point_of_object = k.acceleration[:2] + k.acceleration[2] * turn @ arm - spin**2 * arm
        sliding = k.acceleration[3 + i] * tangent
        sliding += 2.0 * spin * p.state.slip_velocity[i] * turn @ tangent
        finger = k.finger_jacobians[i] @ k.joint_accelerations[i]
        bias = point_of_object + sliding - finger
        scale = 1.0 + np.abs(finger).max()
        expected = p.terms.jacobian_rate_times_velocity[i]
        np.testing.assert_allclose(bias, expected, rtol=0.0, atol=TOLERANCE * scale)


@each_hand
def test_inertia_and_bias_of_each_finger_are_pinocchio_s(n, seed):
    """M and h follow from how the joints answer to torques: tau - J_c^T F = M q'' + h."""
    p = hand_point(n, seed)
    rng = np.random.default_rng(seed)
    answers = [
        evaluate_state(p.scenario, 0.4, *p.state, p.phase, p.estimates, torque=torque)
        for torque in rng.uniform(-20.0, 20.0, (12, 2 * n))
    ]
    for i in range(n):
        rows = slice(2 * i, 2 * i + 2)
        J_c = p.kernel.contact_frames[i].T @ p.kernel.finger_jacobians[i]
        moved = np.array([[*a.joint_accelerations[i], 1.0] for a in answers])
        driven = np.array([a.torques[rows] - J_c.T @ a.contact_forces[i] for a in answers])
        recovered = np.linalg.lstsq(moved, driven, rcond=None)[0].T
        assert_close(recovered[:, :2], p.terms.inertia[rows, rows])
        assert_close(recovered[:, 2], p.terms.bias[rows])


@each_phase
def test_columns_of_link_masses_in_our_regressor_are_pinocchio_s(phase):
    """U of Eq. 21: its column of a link is that link's torque per kilogram, seen by x."""
    p = point(phase, 0)
    k, n = p.kernel, len(phase)
    torques = p.hand.link_regressor(k.joint_positions, k.joint_velocities, k.joint_accelerations)
    _, D = friction_rows(phase, np.array([f.friction for f in p.scenario.fingers]))
    J_c = np.zeros((2 * n, 2 * n))
    for i in range(n):
        rows = slice(2 * i, 2 * i + 2)
        J_c[rows, rows] = k.contact_frames[i].T @ p.terms.jacobians[i]
    expected = np.vstack((k.grasp_matrix, -D)) @ np.linalg.solve(J_c.T, torques)
    assert_close(k.regressor[:, : 2 * n], expected)


@each_phase
def test_motion_solves_all_equations_at_once_with_pinocchio_s_fingers(phase):
    """Eq. 15 for all unknowns together (q'', q_o'', s'', F), every phase of 2, 3, 4 fingers."""
    p = point(phase, 0)
    k = p.kernel
    motion = p.hand.solve_all_unknowns(
        p.state, k.joint_positions, k.joint_velocities, phase, p.torques
    )
    assert_close(k.joint_accelerations, motion.joint_accelerations)
    assert_close(k.acceleration, motion.acceleration)
    assert_close(k.contact_forces, motion.forces)


@each_hand
def test_the_numpy_reference_has_pinocchio_s_fingers(n, seed):
    p = hand_point(n, seed)
    loop = ClosedLoop.from_scenario(p.scenario)
    kin = loop.hand.kinematics(p.state)
    M, h = loop.hand.finger_dynamics(kin, loop.truth)
    terms = p.hand.terms(kin.q, kin.qd)
    assert_close(M, terms.inertia)
    assert_close(h, terms.bias)
    assert_close(kin.jacobians, terms.jacobians)
    rates = [
        f.jacobian_rate_times_velocity(q, qd)
        for f, q, qd in zip(loop.hand.fingers, kin.q, kin.qd, strict=True)
    ]
    assert_close(rates, terms.jacobian_rate_times_velocity)


def test_pinocchio_gives_the_paper_s_inertia_of_two_uniform_rods():
    """Closed form with l = m = 1: M_11 = 5/3 + cos q_2, M_12 = 1/3 + cos(q_2)/2, M_22 = 1/3."""
    hand = PinocchioHand(load_scenario("paper-case-1"))
    for q2 in (-1.5, 0.3, 2.0):
        q = np.array([[0.7, q2], [0.1, -q2]])
        M = hand.terms(q, np.zeros((2, 2))).inertia[:2, :2]
        coupling = 1.0 / 3.0 + 0.5 * np.cos(q2)
        expected = [[5.0 / 3.0 + np.cos(q2), coupling], [coupling, 1.0 / 3.0]]
        np.testing.assert_allclose(M, expected, rtol=0.0, atol=1e-14)
