"""The kernel's quadratic programs against a library, and by the conditions of their optimum."""

import numpy as np
import pytest
from quadprog import solve_qp
from scipy.optimize import nnls

from core.kernel import quadratic
from core.kernel.compiler import call, from_python
from core.kernel.records import make_record

largest_violation = from_python(quadratic.largest_violation)


def pose(normals, bounds, equalities):
    problem = make_record(quadratic.QUADRATIC)
    problem.rows, problem.columns = normals.shape
    problem.equalities = equalities
    problem.normals[: problem.rows, : problem.columns] = normals
    problem.bounds[: problem.rows] = bounds
    return problem


def solve(normals, bounds, equalities=0):
    """The least-norm point, or None where there is none."""
    problem = pose(normals, bounds, equalities)
    solved = call(quadratic.solve_quadratic, problem)
    return problem.solution[: problem.columns].copy() if solved else None


def solve_by_library(normals, bounds, equalities=0):
    size = normals.shape[1]
    try:
        return solve_qp(np.eye(size), np.zeros(size), normals.T.copy(), bounds, equalities)[0]
    except ValueError as error:
        assert "inconsistent" in str(error)
        return None


def random_problem(rng, *, feasible):
    """As many rows as a hand may have; some of them twice or as sums of others."""
    size = int(rng.integers(1, 13))
    equalities = int(rng.integers(0, min(size, 9)))
    rows = equalities + int(rng.integers(1, 49))
    normals = rng.normal(size=(rows, size))
    point = 10.0 * rng.normal(size=size)
    slack = np.where(rng.random(rows) < 0.3, 0.0, rng.exponential(5.0, rows))
    slack[:equalities] = 0.0
    copies = rng.integers(equalities, rows, (rows // 4, 2))
    normals[copies[:, 0]], slack[copies[:, 0]] = normals[copies[:, 1]], slack[copies[:, 1]]
    bounds = normals @ point - slack
    if not feasible:
        against = rng.integers(equalities, rows)
        normals = np.vstack((normals, -normals[against]))
        bounds = np.append(bounds, 1.0 - bounds[against])
    return normals, bounds, equalities


@pytest.mark.parametrize("seed", range(300))
def test_random_problems_have_the_answer_of_a_library(seed):
    normals, bounds, equalities = random_problem(np.random.default_rng(seed), feasible=True)
    expected = solve_by_library(normals, bounds, equalities)
    assert expected is not None
    actual = solve(normals, bounds, equalities)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(100))
def test_the_answer_meets_the_conditions_of_an_optimum(seed):
    """It keeps every row, and is a combination of the normals it touches, pushing only inwards."""
    normals, bounds, equalities = random_problem(np.random.default_rng([1, seed]), feasible=True)
    point = solve(normals, bounds, equalities)
    excess = normals @ point - bounds
    np.testing.assert_allclose(excess[:equalities], 0.0, atol=1e-10)
    assert excess.min() > -1e-10
    touching = np.flatnonzero(excess < 1e-9)
    free = normals[:equalities]
    _, residual = nnls(np.vstack((normals[touching], -free)).T, point)
    assert residual < 1e-8


@pytest.mark.parametrize("seed", range(100))
def test_contradictions_are_found(seed):
    normals, bounds, equalities = random_problem(np.random.default_rng([2, seed]), feasible=False)
    assert solve_by_library(normals, bounds, equalities) is None
    assert solve(normals, bounds, equalities) is None


def test_nothing_is_done_where_zero_is_inside():
    rng = np.random.default_rng(3)
    np.testing.assert_array_equal(solve(rng.normal(size=(20, 5)), -rng.random(20)), np.zeros(5))


def test_equalities_that_depend_on_each_other_are_refused():
    normals = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 1.0]])
    assert solve(normals, np.array([1.0, 2.0, 0.0]), equalities=2) is None


def test_many_rows_through_one_point_end_there():
    """A corner where far more rows meet than it takes: every one is at its bound."""
    angles = np.linspace(0.1, np.pi - 0.1, 40)
    normals = np.column_stack((np.cos(angles), np.sin(angles)))
    corner = np.array([0.0, 7.0])
    np.testing.assert_allclose(solve(normals, normals @ corner), corner, atol=1e-13)


def test_the_same_problem_has_the_same_answer_to_the_last_bit():
    problem = random_problem(np.random.default_rng(4), feasible=True)
    np.testing.assert_array_equal(solve(*problem), solve(*problem))


def test_the_largest_violation_is_that_of_the_worst_inequality():
    problem = pose(np.eye(3), np.array([5.0, 1.0, 2.5]), 1)
    assert largest_violation(problem) == 2.5
    problem.solution[:3] = 9.0
    assert largest_violation(problem) == 0.0
