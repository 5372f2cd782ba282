"""The references themselves: each of their formulas against a second, slower way."""

import numpy as np
import pytest
from scipy.optimize import linprog

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from tests.references.closed_loop import ClosedLoop
from tests.references.controller import lyapunov_matrices, regressor
from tests.references.grasp import squeeze
from tests.references.hand import Parameters, State
from tests.references.hands import UNKNOWN_KINDS, random_estimates, random_scenario, random_state
from tests.references.open_contacts import OPEN, Instant
from tests.references.spatial_cases import planar
from tests.references.spatial_run import Simulator
from tests.references.world import World

SIZES = (2, 3, 4)
STEP = 1e-6


def _random_phase(rng, n):
    return rng.integers(-1, 2, n)


def _shifted(state: State, dt: float) -> State:
    return state._replace(
        pose=state.pose + dt * state.velocity, slip=state.slip + dt * state.slip_velocity
    )


@pytest.mark.parametrize("n", SIZES)
def test_joint_velocity_and_bias_are_derivatives_of_the_inverse_kinematics(n):
    rng = np.random.default_rng(n)
    for _ in range(10):
        scenario = random_scenario(rng, n, "nothing")
        hand = ClosedLoop.from_scenario(scenario).hand
        state = random_state(rng, scenario, np.ones(n, int))
        kin = hand.kinematics(state)
        ahead, behind = (hand.kinematics(_shifted(state, dt)) for dt in (STEP, -STEP))
        np.testing.assert_allclose((ahead.q - behind.q) / (2 * STEP), kin.qd, atol=1e-7)
        # With unchanged velocities (no acceleration), A_q qdd = b.
        qdd = (ahead.qd - behind.qd) / (2 * STEP)
        np.testing.assert_allclose(kin.A_q @ qdd.ravel(), kin.b, atol=1e-6)


@pytest.mark.parametrize("n", SIZES)
def test_tips_stay_on_the_object(n):
    rng = np.random.default_rng(n)
    scenario = random_scenario(rng, n, "nothing")
    hand = ClosedLoop.from_scenario(scenario).hand
    state = random_state(rng, scenario, np.ones(n, int))
    tips = [f.tip(q) for f, q in zip(hand.fingers, hand.kinematics(state).q, strict=True)]
    np.testing.assert_allclose(tips, hand.tip_positions(state.pose, state.slip), atol=1e-14)


@pytest.mark.parametrize("n", SIZES)
def test_virtual_work_closes(n):
    rng = np.random.default_rng(n)
    scenario = random_scenario(rng, n, "nothing")
    hand = ClosedLoop.from_scenario(scenario).hand
    kin = hand.kinematics(random_state(rng, scenario, np.ones(n, int)))
    for i in range(n):
        rows = slice(2 * i, 2 * i + 2)
        np.testing.assert_allclose(kin.W[:, rows], -kin.A_o[rows].T @ kin.frames[i], atol=1e-14)
        assert np.linalg.det(kin.frames[i]) == pytest.approx(1.0)


def test_finger_dynamics_are_lagrange_s_equations():
    rng = np.random.default_rng(7)
    for _ in range(20):
        finger = ClosedLoop.from_scenario(random_scenario(rng, 2, "nothing")).hand.fingers[0]
        q, qd, m, g = rng.uniform(-3, 3, 2), rng.uniform(-2, 2, 2), rng.uniform(0.2, 2, 2), 9.81
        M = finger.inertia_matrix(q, m)
        assert np.all(np.linalg.eigvalsh(M) > 0.0)
        C = finger.coriolis_matrix(q, qd, m)
        M_rate = (
            finger.inertia_matrix(q + STEP * qd, m) - finger.inertia_matrix(q - STEP * qd, m)
        ) / (2 * STEP)
        skew = M_rate - 2.0 * C
        np.testing.assert_allclose(skew, -skew.T, atol=1e-8)
        slopes = [
            (finger.potential_energy(q + e, m, g) - finger.potential_energy(q - e, m, g))
            / (2 * STEP)
            for e in STEP * np.eye(2)
        ]
        np.testing.assert_allclose(finger.bias(q, qd, m, g), C @ qd + slopes, atol=1e-7)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("unknown", UNKNOWN_KINDS)
def test_reduced_form_agrees_with_all_equations_solved_at_once(n, unknown):
    rng = np.random.default_rng(n)
    for _ in range(10):
        scenario = random_scenario(rng, n, unknown)
        loop = ClosedLoop.from_scenario(scenario)
        phase = _random_phase(rng, n)
        kin = loop.hand.kinematics(random_state(rng, scenario, phase))
        torques = rng.uniform(-20, 20, 2 * n)
        motion = loop.hand.solve_all_unknowns(kin, loop.truth, phase, torques)
        reduced = loop.hand.reduced_form(kin, loop.truth, phase)
        left = reduced.M @ motion.acceleration + reduced.h
        np.testing.assert_allclose(left, reduced.B @ torques, rtol=1e-8, atol=1e-8)
        estimates = random_estimates(rng, scenario)
        U, known = regressor(loop.hand, kin, loop.unknowns, phase, motion.acceleration)
        believed = loop.hand.reduced_form(kin, loop.unknowns.fill(estimates), phase)
        left = believed.M @ motion.acceleration + believed.h
        np.testing.assert_allclose(U @ estimates + known, left, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("n", SIZES)
def test_an_open_contact_carries_nothing_and_its_finger_moves_by_itself(n):
    rng = np.random.default_rng(n)
    for _ in range(10):
        rough = {f"fingers.{i}.joint_damping": rng.uniform(0.0, 1.0) for i in range(n)}
        rough |= {f"fingers.{i}.joint_friction": rng.uniform(0.0, 1.0) for i in range(n)}
        scenario = with_values(random_scenario(rng, n, "nothing"), rough)
        loop = ClosedLoop.from_scenario(scenario)
        phase = _random_phase(rng, n)
        state = random_state(rng, scenario, phase)
        kin, instant = loop.hand.kinematics(state), Instant(loop, state)
        torques = rng.uniform(-20, 20, 2 * n)
        touching = instant.solve(tuple(phase), torques)
        motion = loop.solve_plant(state, phase, torques)
        np.testing.assert_allclose(touching.forces, motion.forces, rtol=1e-8, atol=1e-8)
        np.testing.assert_array_equal(np.abs(touching.gap_accelerations) < 1e-9, True)
        answer = instant.solve((OPEN,) * n, torques)
        np.testing.assert_allclose(answer.forces, 0.0, atol=1e-9)
        # The object falls; each fingertip goes where its own torques send it.
        M, h = loop.hand.finger_dynamics(kin, loop.truth)
        rates = kin.qd.ravel()
        h += np.repeat([finger.joint_damping for finger in scenario.fingers], 2) * rates
        dry = np.repeat([finger.joint_friction for finger in scenario.fingers], 2)
        h += dry * rates / np.sqrt(rates**2 + 0.01**2)
        falls = np.array([0.0, -loop.hand.gravity, 0.0])
        for i in range(n):
            rows = slice(2 * i, 2 * i + 2)
            alone = np.linalg.solve(M[rows, rows], torques[rows] - h[rows])
            apart = kin.A_q[rows, rows] @ alone + kin.A_o[rows] @ falls - kin.b[rows]
            tangent, inward = -kin.frames[i][:, 0], kin.frames[i][:, 1]
            assert answer.slip_accelerations[i] == pytest.approx(tangent @ apart, abs=1e-7)
            assert answer.gap_accelerations[i] == pytest.approx(-inward @ apart, abs=1e-7)


def test_lyapunov_equation_holds_where_it_can_be_solved():
    K_p, K_v = np.array([100.0, 50.0, 0.0]), np.array([10.0, 5.0, 8.0])
    Q = np.array([20.0, 3.0, 4.0])
    P11, P12, P22 = (np.diag(d) for d in lyapunov_matrices(K_p, K_v, Q))
    P = np.block([[P11, P12], [P12, P22]])
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(K_p), -np.diag(K_v)]])
    weight = np.diag([20.0, 3.0, 0.0, 20.0, 3.0, 4.0])  # Q weighs only the rate where K_p = 0
    np.testing.assert_allclose(A.T @ P + P @ A, -weight, atol=1e-12)


def _linear_programme(base, direction, cones):
    """Least worst violation, then the least size, by two linear programmes in (c, extra)."""
    rows, limits = [], []
    for side in (1.0, -1.0):
        rows += list(np.column_stack((side * direction[:, 0] - cones * direction[:, 1],)))
        limits += list(cones * base[:, 1] - side * base[:, 0])
    slope, limits = np.array(rows)[:, 0], np.array(limits)
    free = (None, None)
    first = linprog(
        [0.0, 1.0],
        A_ub=np.column_stack((slope, -np.ones(len(slope)))),
        b_ub=limits,
        bounds=[free, (0.0, None)],
    )
    violation = first.x[1]
    size = linprog(
        [0.0, 1.0],
        A_ub=np.vstack((np.column_stack((slope, 0 * slope)), [[1.0, -1.0], [-1.0, -1.0]])),
        b_ub=np.concatenate((limits + violation + 1e-12, [0.0, 0.0])),
        bounds=[free, (0.0, None)],
    )
    return size.x[0], violation


@pytest.mark.slow
def test_closed_form_of_the_squeeze_agrees_with_linear_programming():
    rng = np.random.default_rng(3)
    violated = 0
    for _ in range(200):
        base, direction = rng.uniform(-5, 5, (2, 2)), rng.uniform(-1, 1, (2, 2))
        direction[:, 1] = np.abs(direction[:, 1])
        cones = rng.uniform(0.1, 1.0, 2)
        c, violation = squeeze(base, direction, cones)
        expected, least = _linear_programme(base, direction, cones)
        assert violation == pytest.approx(least, abs=1e-7)
        assert c == pytest.approx(expected, abs=1e-5)
        violated += violation > 0.0
    assert 20 < violated < 180


def test_grasp_force_moves_neither_object_nor_reduced_coordinates():
    rng = np.random.default_rng(5)
    for _ in range(20):
        scenario = random_scenario(rng, 2, "masses")
        loop = ClosedLoop.from_scenario(scenario)
        phase = np.zeros(2, int)
        state = random_state(rng, scenario, phase)
        estimates = random_estimates(rng, scenario)
        desired = loop.trajectory.desired(0.5)
        believed: Parameters = loop.unknowns.fill(estimates)
        now = loop.evaluate(state, phase, estimates, desired)
        v = loop.law.commanded_acceleration(state, phase, desired)
        reduced = loop.hand.reduced_form(now.kin, believed, phase)
        np.testing.assert_allclose(reduced.B @ now.torques, reduced.M @ v + reduced.h, atol=1e-8)
        # The plant that the controller believes in feels forces inside (or on) its cones.
        motion = loop.hand.solve_all_unknowns(now.kin, believed, phase, now.torques)
        np.testing.assert_allclose(motion.acceleration, v, atol=1e-7)
        bound = believed.friction / loop.law.grip_safety * motion.forces[:, 1]
        worst = np.max(np.abs(motion.forces[:, 0]) - bound)
        assert worst <= now.violation + 1e-9


def test_desired_motion_is_integrated_exactly():
    loop = ClosedLoop.from_scenario(random_scenario(np.random.default_rng(1), 2, "nothing"))
    path = loop.trajectory
    for t in (0.3, 1.7, 3.4, 5.0):
        _, velocity, acceleration = path.desired(t)
        ahead, behind = path.desired(t + 1e-4), path.desired(t - 1e-4)
        np.testing.assert_allclose((ahead[0] - behind[0]) / 2e-4, velocity, atol=1e-10)
        np.testing.assert_allclose((ahead[1] - behind[1]) / 2e-4, acceleration, atol=1e-9)
    np.testing.assert_allclose(path.desired(5.0)[1], 0.0, atol=1e-15)
    np.testing.assert_allclose(path.desired(5.0)[0], path.start + 3.0 * path.acceleration)


def test_a_fingertip_at_rest_on_an_edge_has_the_smaller_friction_of_both_sides():
    base, sides = load_scenario("paper-case-1"), {}
    for factor in (0.5, 1.5):
        patch = {"face": "left", "centre": 0.03, "half_length": 0.03, "friction_factor": factor}
        scenario = scenario_from_mapping(base.to_mapping() | {"patches": [patch]})
        world = World.from_scenario(scenario)
        n, start = len(scenario.fingers), scenario.trajectory.start
        at_rest = np.concatenate((start, np.zeros(3 + 2 * n)))
        sides[factor] = world.loop(0.0, world.sides(0.0, at_rest)).truth.friction
        shown = simulate(with_values(scenario, {"simulation.duration": 0.001})).trace
        np.testing.assert_array_equal(shown.friction_coefficient[0], sides[factor])
    assert sides[0.5][0] == 0.5 * sides[1.5][0]


@pytest.mark.slow
def test_the_reference_in_space_prints_the_figures_of_case_1_with_sampled_control():
    """Those that a prototype printed before it was written (docs/space.md)."""
    run = Simulator(planar(1)._replace(tolerance=1e-8), (0.05,)).simulate(0.089)
    assert [f"{1e3 * end:.6f}" for end in run.slip_ends] == ["87.983946", "85.454700"]
    assert [f"{1e3 * path:.7f}" for path in run.slip_path] == ["2.6720528", "2.2098970"]
    assert round(1e3 * run.errors[0][2], 3) == 5.817
    assert abs(run.ledger) < 2e-9
    assert max(np.abs(run.slip[:, 1]).max(), np.abs(run.errors[0][[1, 3, 5]]).max()) < 1e-12
