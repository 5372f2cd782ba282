"""The kernel's quadratic programs against a library, and by the conditions of their optimum."""

import numpy as np
from scipy.optimize import linprog

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.numerics import quadratic
from tests.each_case import each_case
from tests.references.grasp import minimise
from tests.state_evaluation import from_python

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


def random_problem(rng):
    """As many rows as a hand may have, a third of them through the same point."""
    columns = int(rng.integers(1, 13))
    equalities = int(rng.integers(0, min(columns, 9)))
    rows = equalities + int(rng.integers(1, 49))
    normals = rng.normal(size=(rows, columns))
    slack = np.where(rng.random(rows) < 0.3, 0.0, rng.exponential(5.0, rows))
    slack[:equalities] = 0.0
    return normals, normals @ (10.0 * rng.normal(size=columns)) - slack, equalities


def degenerate_problem(rng):
    """The same with rows that are there twice."""
    normals, bounds, equalities = random_problem(rng)
    copies = rng.integers(equalities, len(bounds), (len(bounds) // 4, 2))
    normals[copies[:, 0]], bounds[copies[:, 0]] = normals[copies[:, 1]], bounds[copies[:, 1]]
    return normals, bounds, equalities


@each_case("seed", range(300))
def test_random_problems_have_the_answer_of_a_library(seed):
    make = degenerate_problem if seed % 2 else random_problem
    normals, bounds, m = make(np.random.default_rng(seed))
    expected = minimise(normals[:m], bounds[:m], normals[m:], bounds[m:])
    actual = solve(normals, bounds, m)
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-9)


@each_case("seed", range(200))
def test_the_answer_meets_the_conditions_of_an_optimum(seed):
    """It keeps every row, and is a combination of the normals it touches, pushing only inwards."""
    normals, bounds, equalities = degenerate_problem(np.random.default_rng([1, seed]))
    point = solve(normals, bounds, equalities)
    excess = normals @ point - bounds
    np.testing.assert_allclose(excess[:equalities], 0.0, atol=1e-10)
    assert excess.min() > -1e-10
    touching = np.flatnonzero(excess < 1e-9)
    if len(touching) == 0:
        assert not point.any()
        return
    signs = [(None, None) if row < equalities else (0.0, None) for row in touching]
    multipliers = linprog(
        np.zeros(len(touching)), A_eq=normals[touching].T, b_eq=point, bounds=signs
    )
    assert multipliers.status == 0


@each_case("seed", range(100))
def test_contradictions_are_found(seed):
    rng = np.random.default_rng([2, seed])
    normals, bounds, equalities = degenerate_problem(rng)
    against = rng.integers(equalities, len(bounds))
    normals = np.vstack((normals, -normals[against]))
    bounds = np.append(bounds, 1.0 - bounds[against])
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
    problem = degenerate_problem(np.random.default_rng(4))
    np.testing.assert_array_equal(solve(*problem), solve(*problem))


def test_the_largest_violation_is_that_of_the_worst_inequality():
    problem = pose(np.eye(3), np.array([5.0, 1.0, 2.5]), 1)
    assert largest_violation(problem) == 2.5
    problem.solution[:3] = 9.0
    assert largest_violation(problem) == 0.0
