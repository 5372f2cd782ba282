"""The reference of the model in space held against identities and Pinocchio, n = 2, 3, 4.

What the kernel is tested against must be right itself: virtual work, the four blocks of Eq. 15,
power, the regressor, and the closed loop with true parameters.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.pinocchio_space import finger_terms
from tests.references.spatial_cases import HEIGHT, prism_hand, s1, theorem_law
from tests.references.spatial_contact import Problem, forces_in
from tests.references.spatial_fingers import UP
from tests.references.spatial_hands import (
    at_rest_where_stuck,
    cone_phases,
    moved,
    pyramid_phases,
    random_sample,
)
from tests.references.spatial_law import (
    Desired,
    Unknowns,
    left_hand_side,
    left_jacobian,
    regressor,
    tracking_errors,
)
from tests.references.spatial_plant import (
    State,
    all_stick,
    block_diagonal,
    contact_forces,
    cross_matrix,
    finger_dynamics,
    forces_of_torques,
    friction_rows,
    own_torques,
    rotation_matrix,
)

SIZES = (2, 3, 4)
SEEDS = range(4)
STEP = 1e-6


def phases_of(sample, rng):
    """All phases of the cone, and some of the pyramid."""
    n = len(sample.state.slip)
    return [*cone_phases(sample.state), *pyramid_phases(rng, n, 12)]


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_virtual_work_closes_and_contact_frames_are_rotations(n, seed):
    sample = random_sample(np.random.default_rng(seed), n)
    kin = sample.hand.kinematics(sample.state)
    np.testing.assert_allclose(kin.W, -kin.A_o.T @ block_diagonal(kin.frames), atol=1e-15)
    for C in kin.frames:
        np.testing.assert_allclose(C.T @ C, np.eye(3), atol=1e-14)
        assert np.linalg.det(C) == pytest.approx(1.0)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_tips_stay_on_the_object_and_their_rates_are_differences(n, seed):
    rng = np.random.default_rng(seed)
    sample = random_sample(rng, n)
    acceleration = rng.uniform(-3.0, 3.0, 6 + 2 * n)
    hand, kin = sample.hand, sample.hand.kinematics(sample.state)
    ahead, behind = (hand.kinematics(moved(sample.state, acceleration, dt)) for dt in (STEP, -STEP))
    tips = sample.state.position + kin.arms
    np.testing.assert_allclose(hand.fingers.tips(kin.q), tips, atol=1e-14)
    np.testing.assert_allclose((ahead.q - behind.q) / (2 * STEP), kin.qd, atol=2e-8)
    qdd = (ahead.qd - behind.qd) / (2 * STEP)
    wanted = kin.b - kin.A_o @ acceleration[:6] - kin.A_s @ acceleration[6:]
    np.testing.assert_allclose((kin.jacobians @ qdd[:, :, None]).ravel(), wanted, atol=2e-8)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_fingers_agree_with_pinocchio(n, seed):
    sample = random_sample(np.random.default_rng(seed), n)
    kin = sample.hand.kinematics(sample.state)
    M, h = finger_dynamics(kin, sample.parameters)
    for i in range(n):
        masses = sample.parameters.link_masses[i]
        other = finger_terms(sample.hand.fingers, i, masses, 9.81, kin.q[i], kin.qd[i])
        np.testing.assert_allclose(M[i], other.inertia, atol=1e-13)
        np.testing.assert_allclose(h[i], other.bias, atol=1e-12)
        np.testing.assert_allclose(sample.state.position + kin.arms[i], other.tip, atol=1e-14)
        np.testing.assert_allclose(kin.jacobians[i], other.jacobian, atol=1e-13)
        tips = np.linalg.solve(other.jacobian, other.jacobian_rate_times_velocity)
        qdd = np.linalg.solve(kin.jacobians[i], _own_drift(sample, kin)[i])
        np.testing.assert_allclose(qdd, tips, atol=1e-12)


def _own_drift(sample, kin):
    """J' q' of every finger: b without what the object's motion adds."""
    state = sample.state
    spin = cross_matrix(state.velocity[3:])
    relative = (-kin.frames[:, :, :2] @ state.slip_velocity[:, :, None])[:, :, 0]
    return kin.arms @ (spin @ spin).T + 2.0 * relative @ spin.T - kin.b.reshape(-1, 3)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_three_ways_to_the_motion_agree_in_every_phase(n, seed):
    rng = np.random.default_rng(seed)
    sample = random_sample(rng, n)
    for phase in phases_of(sample, rng):
        state = at_rest_where_stuck(sample.state, phase)
        hand, kin, spin = sample.hand, sample.hand.kinematics(state), state.velocity[3:]
        motion = hand.solve_all_unknowns(
            kin, sample.parameters, phase, sample.torques, sample.load, spin
        )
        reduced = hand.reduced_form(kin, sample.parameters, phase, spin)
        right = reduced.B @ sample.torques.ravel() - reduced.h
        right[:6] += sample.load
        scale = 1.0 + np.abs(motion.acceleration).max()
        acceleration = np.linalg.solve(reduced.M, right)
        np.testing.assert_allclose(acceleration, motion.acceleration, atol=1e-11 * scale)
        forces = contact_forces(kin, sample.parameters, sample.torques, motion.acceleration)
        np.testing.assert_allclose(forces, motion.forces, atol=1e-11 * scale)
        problem = contact_problem(sample, kin, state)
        again = forces_in(problem, phase)
        np.testing.assert_allclose(again, motion.forces, atol=1e-10 * scale)
        w = (problem.G @ motion.forces.ravel() + problem.c).reshape(n, 3)
        slips = motion.acceleration[6:].reshape(n, 2)
        np.testing.assert_allclose(w[:, :2], slips, atol=1e-10 * scale)
        np.testing.assert_allclose(w[:, 2], 0.0, atol=1e-10 * scale)


def contact_problem(sample, kin, state):
    n = len(state.slip)
    G, c = sample.hand.contact_space(kin, state, sample.parameters, sample.torques, sample.load)
    none = np.zeros((n, 2))
    return Problem(G, c, sample.parameters.friction, none > 0.0, none, none > 0.0)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_contact_space_is_symmetric_and_positive_definite(n, seed):
    sample = random_sample(np.random.default_rng(seed), n)
    G = contact_problem(sample, sample.hand.kinematics(sample.state), sample.state).G
    np.testing.assert_allclose(G, G.T, atol=1e-12)
    assert np.linalg.eigvalsh(G).min() > 0.0


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("seed", SEEDS)
def test_power_of_torques_and_load_goes_into_energy_and_friction(n, seed):
    rng = np.random.default_rng(seed)
    sample = random_sample(rng, n)
    for phase in phases_of(sample, rng):
        directed = np.where(phase.sticks, 0.0, phase.directions * rng.uniform(0.1, 0.3, (n, 2)))
        state = sample.state._replace(slip_velocity=directed)
        phase = phase._replace(directions=_along(phase, directed))
        hand, parameters = sample.hand, sample.parameters
        kin = hand.kinematics(state)
        motion = hand.solve_all_unknowns(
            kin, parameters, phase, sample.torques, sample.load, state.velocity[3:]
        )
        energy = [
            sum(hand.energies(hand.kinematics(later), later, parameters))
            for later in (moved(state, motion.acceleration, dt) for dt in (STEP, -STEP))
        ]
        lost = sum(_loss(phase, state, motion.forces, parameters.friction))
        power = np.sum(sample.torques * kin.qd) + sample.load @ state.velocity - lost
        size = 1.0 + abs(power) + np.abs(motion.acceleration).max()
        assert (energy[0] - energy[1]) / (2 * STEP) == pytest.approx(power, abs=1e-7 * size)


def _along(phase, velocity):
    """Directions of the cone follow the slip; those of the pyramid are signs."""
    on_cone = ~phase.sticks.any(axis=1) & (np.linalg.norm(phase.directions, axis=1) < 1.2)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    return np.where(on_cone[:, None], velocity / np.where(speed > 0, speed, 1), phase.directions)


def _loss(phase, state, forces, mu):
    """Mu F_n times the speed of slip: its norm on the cone, its one-norm on the pyramid."""
    for i, velocity in enumerate(state.slip_velocity):
        on_cone = np.linalg.norm(phase.directions[i]) < 1.2 and not phase.sticks[i].any()
        speed = np.linalg.norm(velocity) if on_cone else np.abs(velocity).sum()
        yield mu[i] * forces[i, 2] * speed


UNKNOWN = {
    "masses": lambda n: [
        *(f"fingers.{i}.link_masses.{k}" for i in range(n) for k in range(2)),
        "object.mass",
        *(f"object.inertias.{k}" for k in range(3)),
    ],
    "friction": lambda n: [
        *(f"fingers.{i}.friction" for i in range(n)),
        "object.mass",
        *(f"object.inertias.{k}" for k in range(3)),
    ],
}


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("kind", UNKNOWN)
def test_regressor_gives_the_left_hand_side_in_every_phase(n, kind):
    rng = np.random.default_rng(n)
    sample = random_sample(rng, n)
    unknowns = Unknowns(tuple(UNKNOWN[kind](n)), sample.parameters)
    values = rng.uniform(0.1, 2.0, len(unknowns.keys))
    spin, acceleration = sample.state.velocity[3:], rng.uniform(-3.0, 3.0, 6 + 2 * n)
    for phase in phases_of(sample, rng):
        kin = sample.hand.kinematics(sample.state)
        U, known = regressor(sample.hand, kin, unknowns, phase, acceleration, spin)
        believed = unknowns.fill(values)
        reduced = sample.hand.reduced_form(kin, believed, phase, spin)
        side = reduced.M @ acceleration + reduced.h
        np.testing.assert_allclose(U @ values + known, side, atol=1e-11)
        rows = left_hand_side(sample.hand, kin, believed, phase, acceleration, spin)
        np.testing.assert_allclose(rows, side, atol=1e-11)


def test_columns_of_the_regressor_are_those_written_down():
    """Mass v' + g z; inertia e (e omega') + omega x e (e omega); friction -gamma F_n."""
    rng = np.random.default_rng(5)
    sample = random_sample(rng, 3)
    state = sample.state
    spin, acceleration = state.velocity[3:], rng.uniform(-3.0, 3.0, 12)
    kin = sample.hand.kinematics(state)
    phase = list(cone_phases(state))[-1]
    unknowns = Unknowns(tuple(UNKNOWN["friction"](3)), sample.parameters)
    U, _ = regressor(sample.hand, kin, unknowns, phase, acceleration, spin)
    own = own_torques(kin, sample.parameters, acceleration)
    f = forces_of_torques(kin, own)
    for i in range(3):
        column = np.zeros(12)
        column[6 + 2 * i : 8 + 2 * i] = -phase.directions[i] * f[i, 2]
        np.testing.assert_allclose(U[:, i], column, atol=1e-12)
        e = kin.rotation[:, i]
        moment = e * (e @ acceleration[3:6]) + np.cross(spin, e * (e @ spin))
        np.testing.assert_allclose(U[3:6, 4 + i], moment, atol=1e-13)
    np.testing.assert_allclose(U[:3, 3], acceleration[:3] + 9.81 * UP, atol=1e-13)


def moving_attitude(t):
    """A desired attitude that turns about two axes, by scipy's rotations."""
    return Rotation.from_euler("zyx", [0.8 * t, 0.5 * np.sin(t), 0.3 * t**2])


def desired_at(t):
    """Its spin and the rate of that by differences of the rotation itself."""
    dt = 1e-4

    def spin(at):
        turn = moving_attitude(at + dt) * moving_attitude(at - dt).inv()
        return turn.as_rotvec() / (2 * dt)

    zero = np.zeros(3)
    rate = (spin(t + dt) - spin(t - dt)) / (2 * dt)
    rotation = moving_attitude(t).as_matrix()
    return Desired(np.array([0, 0, HEIGHT]), zero, zero, rotation, spin(t), rate)


@pytest.mark.parametrize("tilt", [0.0, 1e-5, 0.3, 1.0, 2.5])
def test_left_jacobian_is_that_of_the_rotation_vector(tilt):
    rng = np.random.default_rng(1)
    axis, rate = rng.normal(size=3), rng.normal(size=3)
    rho = tilt * axis / np.linalg.norm(axis)
    A, A_rate = left_jacobian(rho, rate)
    dt = 1e-6
    ahead, behind = (Rotation.from_rotvec(rho + s * dt * rate) for s in (1.0, -1.0))
    np.testing.assert_allclose((ahead * behind.inv()).as_rotvec() / (2 * dt), A @ rate, atol=1e-8)
    later, before = (left_jacobian(rho + s * dt * rate, rate)[0] for s in (1.0, -1.0))
    np.testing.assert_allclose((later - before) / (2 * dt), A_rate, atol=1e-8)
    a = (1 - np.cos(tilt)) / tilt**2 if tilt > 1e-3 else 0.5
    b = (tilt - np.sin(tilt)) / tilt**3 if tilt > 1e-3 else 1 / 6
    S = cross_matrix(rho)
    np.testing.assert_allclose(A, np.eye(3) + a * S + b * S @ S, atol=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.5, 1.0])
def test_closed_loop_in_stick_is_linear_in_the_rotation_vector(tilt):
    """With true parameters rho'' + K_v rho' + K_p rho = 0, and the same for the position."""
    rng = np.random.default_rng(7)
    hand, truth = prism_hand(), s1().truth
    law, desired = theorem_law(3, 1, distribution="exact"), desired_at(0.3)
    axis = rng.normal(size=3)
    error = Rotation.from_rotvec(tilt * axis / np.linalg.norm(axis))
    x, y, z, w = (error * moving_attitude(0.3)).as_quat()
    rest = np.zeros((3, 2))
    position = np.array([0.01, 0.02, HEIGHT - 0.01])
    state = State(position, np.array([w, x, y, z]), rng.uniform(-1, 1, 6), rest, rest)
    # Only the object's frame is turned: the fingers go where its contacts are.
    hand = hand._replace(anchors=hand.anchors @ rotation_matrix(state.quaternion))
    kin, spin, stick = hand.kinematics(state), state.velocity[3:], all_stick(3)
    errors = tracking_errors(state, kin.rotation, desired)
    v = law.commanded_acceleration(errors, stick, desired)
    command = law.command(hand, kin, truth, stick, v, spin)
    motion = hand.solve_all_unknowns(kin, truth, stick, command.torques, spin=spin)
    np.testing.assert_allclose(motion.acceleration[:6], v[:6], atol=1e-9)
    rho_rates = []
    for dt in (1e-4, -1e-4):
        later = moved(state, motion.acceleration, dt)
        turned = rotation_matrix(later.quaternion)
        rho_rates.append(tracking_errors(later, turned, desired_at(0.3 + dt)).rate[3:6])
    bend = -(rho_rates[0] - rho_rates[1]) / 2e-4
    np.testing.assert_allclose(bend, 10.0 * errors.rate[3:6] + 100.0 * errors.e[3:6], atol=1e-4)


def test_determinant_vanishes_where_all_tips_slide_down_with_much_friction():
    """At the start of the samples det M~ is positive in stick and zero at mu = 1.347."""
    world = s1()
    rest = np.zeros((3, 2))
    state = State(world.position, np.array([1.0, 0, 0, 0]), np.zeros(6), rest, rest)
    kin = world.hand.kinematics(state)
    down = list(cone_phases(state._replace(slip_velocity=np.tile([-1.0, 0.0], (3, 1)))))[-1]

    def determinant(mu, phase):
        believed = world.truth._replace(friction=np.full(3, mu))
        return np.linalg.det(world.hand.reduced_form(kin, believed, phase, np.zeros(3)).M)

    assert determinant(1.3465, down) * determinant(1.3475, down) < 0.0
    assert determinant(0.25, all_stick(3)) > 0.0


def test_friction_rows_are_eq_7():
    rng = np.random.default_rng(3)
    sample = random_sample(rng, 3)
    for phase in phases_of(sample, rng):
        alpha, D = friction_rows(phase, sample.parameters.friction)
        assert np.all(np.diag(alpha)[np.ravel(~phase.sticks)] == 0.0)
        assert np.all(D[np.ravel(phase.sticks)] == 0.0)
