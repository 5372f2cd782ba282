"""Contact in space: slip on the cone in closed form, selection, and the grasp force.

The closed form is the hodograph of a unit mass that slides under a constant pull A, pressed by
N: with theta the angle of the slip from the pull, sigma sin(theta) tan(theta/2)^(-mu N / A) is
constant, and the mass stops at a time that is an integral.
"""

import clarabel
import numpy as np
import pytest
from scipy.integrate import Radau, quad
from scipy.optimize import brentq, minimize_scalar
from scipy.sparse import csc_matrix

from tests.references.spatial_cases import s1
from tests.references.spatial_contact import (
    Problem,
    forces_in,
    margins,
    relative_motion,
    select,
    solve_by_newton,
)
from tests.references.spatial_grasp import cone_bounds, distribute, least_forces, optimality
from tests.references.spatial_hands import at_rest_where_stuck, cone_phases, random_sample
from tests.references.spatial_plant import all_stick, cone_phase
from tests.references.spatial_run import STOP_SPEED, Simulator

PULL, PRESS, MU, SPEED, ANGLE = 0.6, 4.0, 0.25, 0.3, 2.0


def slide(t, velocity):
    direction = velocity / max(np.linalg.norm(velocity), STOP_SPEED)
    return np.array([PULL, 0.0]) - MU * PRESS * direction


def test_slip_on_the_cone_stops_at_the_time_of_the_hodograph():
    k = MU * PRESS / PULL
    constant = SPEED * np.sin(ANGLE) * np.tan(ANGLE / 2) ** -k

    def rate(theta):
        return constant * np.tan(theta / 2) ** k / (PULL * np.sin(theta) ** 2)

    wanted = quad(rate, 0.0, ANGLE, epsabs=1e-13)[0]
    assert wanted == pytest.approx(0.35170870, abs=5e-9)
    start = SPEED * np.array([np.cos(ANGLE), np.sin(ANGLE)])
    solver = Radau(slide, 0.0, start, 1.0, rtol=1e-12, atol=1e-14, first_step=1e-4)
    while np.linalg.norm(solver.y) > STOP_SPEED:
        speed, slowing = np.linalg.norm(solver.y), -solver.y @ slide(0.0, solver.y)
        solver.max_step = 0.6 * speed**2 / slowing if slowing > 0.0 else 1e-2
        solver.step()
        theta = np.arctan2(solver.y[1], solver.y[0])
        if np.linalg.norm(solver.y) > 1e-3:
            invariant = np.linalg.norm(solver.y) * np.sin(theta) * np.tan(theta / 2) ** -k
            assert invariant == pytest.approx(constant, rel=1e-7)
    left = np.linalg.norm(solver.y) / (MU * PRESS - PULL)
    assert solver.t + left == pytest.approx(wanted, abs=1e-9)


def random_problem(rng, n, moving=0, friction="cone"):
    """A contact problem of a random hand; the first contacts move."""
    sample = random_sample(rng, n)
    phase = list(cone_phases(sample.state))[(1 << n) - (1 << (n - moving))]
    state = at_rest_where_stuck(sample.state, phase)
    kin = sample.hand.kinematics(state)
    pressed = np.einsum("nij,nj->ni", kin.frames, rng.uniform([-9, -9, 2], [9, 9, 30], (n, 3)))
    torques = np.einsum("nji,nj->ni", kin.jacobians, pressed)
    torques += 9.81 * kin.bias_per_mass.sum(axis=0) / 9.81
    G, c = sample.hand.contact_space(kin, state, sample.parameters, torques)
    none = np.zeros((n, 2), bool)
    return Problem(G, c, rng.uniform(0.1, 2.0, n), ~phase.sticks, phase.directions, none, friction)


@pytest.mark.parametrize("friction", ["cone", "pyramid"])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_newton_solves_the_contact_problem_and_reduced_phases_give_the_same_forces(n, friction):
    rng = np.random.default_rng(n)
    selected = 0
    for _ in range(60):
        problem = random_problem(rng, n, int(rng.integers(0, n)), friction)
        found = select(problem)
        if found.phase is None:
            continue
        selected += 1
        F, w = found.forces, relative_motion(problem, found.forces)
        scale = 1.0 + np.abs(F).max()
        assert np.all(F[:, 2] > 0.0)
        np.testing.assert_allclose(w[:, 2], 0.0, atol=1e-9 * scale)
        spare = margins(F, problem.mu, friction)
        assert np.all(spare[~problem.moving] > -1e-9 * scale)
        slips = ~found.phase.sticks & ~problem.moving
        np.testing.assert_allclose(spare[slips], 0.0, atol=1e-9 * scale)
        # Friction acts against what starts, and nothing moves where a contact sticks.
        np.testing.assert_allclose(w[:, :2][found.phase.sticks], 0.0, atol=1e-7)
        bound = np.broadcast_to((problem.mu * F[:, 2])[:, None], F[:, :2].shape)
        against = -bound * found.phase.directions
        np.testing.assert_allclose(F[:, :2][slips], against[slips], atol=1e-9 * scale)
        same = forces_in(problem, found.phase)
        np.testing.assert_allclose(same, F, atol=1e-8 * scale)
    assert selected > 30


def test_newton_finds_what_a_search_over_all_directions_finds():
    """One free contact: w_t must be along the direction in which friction is overcome."""
    rng = np.random.default_rng(8)
    compared = 0
    for _ in range(60):
        problem = random_problem(rng, 3, 2)
        stuck = all_stick(3)._replace(
            sticks=~problem.moving, directions=np.where(problem.moving, problem.directions, 0.0)
        )
        forces = forces_in(problem, stuck)
        if np.any(forces[:, 2] <= 0.0) or margins(forces, problem.mu, "cone")[-1, 0] > -1e-3:
            continue

        def relative(angle, problem=problem):
            g = np.array([np.cos(angle), np.sin(angle)])
            phase = cone_phase([*problem.directions[:2], g])
            F = forces_in(problem, phase)
            return relative_motion(problem, F)[-1, :2], g, F

        def across(angle):
            w, g, _ = relative(angle)
            return float(w[0] * g[1] - w[1] * g[0])

        grid = np.linspace(0.0, 2 * np.pi, 721)
        values = [across(angle) for angle in grid]
        roots = [
            brentq(across, a, b, xtol=1e-14)
            for a, b, u, v in zip(grid, grid[1:], values, values[1:], strict=False)
            if u * v < 0.0
        ]
        good = [relative(angle) for angle in roots]
        good = [(g, F) for w, g, F in good if w @ g > 0.0 and np.all(F[:, 2] > 0.0)]
        if len(good) != 1:
            continue
        compared += 1
        found = select(problem)
        np.testing.assert_allclose(found.phase.directions[-1], good[0][0], atol=1e-9)
        np.testing.assert_allclose(found.forces, good[0][1], rtol=1e-9, atol=1e-8)
    assert compared >= 10


def test_newton_starts_anywhere_and_ends_at_one_solution():
    rng = np.random.default_rng(11)
    for _ in range(40):
        problem = random_problem(rng, 3)
        first = select(problem)
        if first.phase is None:
            continue
        for _ in range(4):
            start = rng.normal(0.0, 20.0, (3, 3))
            start[:, 2] = np.abs(start[:, 2])
            again = solve_by_newton(problem, start)
            if again is not None and np.all(again[:, 2] > 0.0):
                np.testing.assert_allclose(again, first.forces, atol=1e-7)


def held_until_it_slips(seed):
    """A hand whose torques are held from rest in stick until a contact reaches its cone."""
    rng = np.random.default_rng(seed)
    simulator = Simulator(s1(grip_safety=1.02))
    simulator.estimates[:] = 1.0
    simulator.z[7:13] = rng.uniform(-1.0, 1.0, 6)
    assert simulator._tick(0.0)
    assert not simulator.phase.slipping.any()
    t, fired = simulator._stretch(0.0, 0.2)
    assert fired is not None
    return simulator, fired, t


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_smooth_onset_slips_against_the_force_that_was_overcome(seed):
    """Slip begins without acceleration, along -F_t; its angle to it grows in proportion to t."""
    simulator, fired, t = held_until_it_slips(seed)
    i = int(np.flatnonzero(fired.any(axis=1))[0])
    _, forces = simulator._plant(simulator.z, simulator.phase)
    onset = -forces[i, :2] / np.linalg.norm(forces[i, :2])
    assert simulator._select(t, fired)
    np.testing.assert_allclose(simulator.phase.directions[i], onset, atol=1e-7)
    acceleration = simulator._plant(simulator.z, simulator.phase)[0][6 + 2 * i : 8 + 2 * i]
    assert np.linalg.norm(acceleration) < 1e-5
    angles = []
    for end in (t + 2e-4, t + 4e-4):
        while t < end:
            t, event = simulator._stretch(t, end)
            assert event is None
        velocity = simulator.z[19 + 2 * i : 21 + 2 * i]
        along = velocity / np.linalg.norm(velocity)
        angles.append(abs(onset[0] * along[1] - onset[1] * along[0]))
    assert angles[1] == pytest.approx(2.0 * angles[0], rel=0.2)
    assert angles[0] < 0.02


def plain_conic(W, d, slope, least):
    """The grasp force by clarabel alone: forces are its unknowns, equalities are equalities."""
    size = W.shape[1]
    rows, right = [W], [d]
    cones = [clarabel.ZeroConeT(len(d))]
    for i in range(size // 3):
        block = np.zeros((3, size))
        block[0, 3 * i + 2], block[1, 3 * i], block[2, 3 * i + 1] = slope[i], 1.0, 1.0
        rows.append(-block)
        right.append(np.zeros(3))
        cones.append(clarabel.SecondOrderConeT(3))
    floor = np.zeros((size // 3, size))
    floor[np.arange(size // 3), 3 * np.arange(size // 3) + 2] = -1.0
    rows.append(floor)
    right.append(np.full(size // 3, -least))
    cones.append(clarabel.NonnegativeConeT(size // 3))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    A, b = csc_matrix(np.vstack(rows)), np.concatenate(right)
    answer = clarabel.DefaultSolver(
        csc_matrix(np.eye(size)), np.zeros(size), A, b, cones, settings
    ).solve()
    solved = str(answer.status) in ("Solved", "AlmostSolved")
    return np.array(answer.x).reshape(-1, 3) if solved else None


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_grasp_force_is_optimal_and_a_conic_solver_finds_none_less(n):
    rng = np.random.default_rng(n)
    compared = 0
    for _ in range(40):
        sample = random_sample(rng, n)
        kin = sample.hand.kinematics(sample.state)
        wrench = kin.W @ rng.uniform([-3, -3, 3], [3, 3, 25], (n, 3)).ravel()
        slope = rng.uniform(0.2, 0.8, n)
        choice = distribute(kin.W, wrench)
        bounds = cone_bounds(np.repeat(slope[:, None], 2, axis=1), 0.5, pyramid=False)
        grasp = least_forces(choice, bounds)
        other = plain_conic(kin.W, wrench, slope, 0.5)
        if grasp.violation > 0.0 or other is None:
            assert other is None or grasp.violation < 1e-6
            continue
        compared += 1
        stationary, excess, multiplier = optimality(choice, bounds, grasp.forces)
        scale = 1.0 + np.abs(grasp.forces).max()
        assert stationary < 1e-10 * scale
        assert excess < 1e-9 * scale
        assert multiplier > -1e-8 * scale
        np.testing.assert_allclose(kin.W @ grasp.forces.ravel(), wrench, atol=1e-10 * scale)
        assert np.sum(grasp.forces**2) < np.sum(other**2) + 1e-7 * scale**2
        np.testing.assert_allclose(grasp.forces, other, atol=1e-4 * scale)
    assert compared >= 10


def test_where_no_force_is_inside_all_cones_the_worst_excess_is_least():
    """Two opposed contacts without enough friction: a closed form over the one squeeze."""
    rng = np.random.default_rng(2)
    sample = random_sample(rng, 2)
    kin = sample.hand.kinematics(sample.state)
    choice = distribute(kin.W, np.array([0.0, 0.0, 50.0, 0.0, 3.0, 0.0]))
    bounds = cone_bounds(np.full((2, 2), 0.05), 0.5, pyramid=False)
    grasp = least_forces(choice, bounds)
    assert grasp.violation > 0.0

    def worst(squeeze):
        F = choice.base + choice.basis[:, 0] * squeeze
        return max(b.value(F) for b in bounds)

    best = minimize_scalar(worst, bounds=(-3e3, 3e3), method="bounded", options={"xatol": 1e-9})
    assert grasp.violation == pytest.approx(best.fun, rel=1e-6)
