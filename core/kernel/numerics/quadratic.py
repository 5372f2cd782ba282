"""Least-norm points under linear constraints, by the dual active-set method.

Goldfarb and Idnani, *A numerically stable dual method for solving strictly convex quadratic
programs*, Mathematical Programming 27 (1983), with the identity as Hessian: minimise |x|^2 with
a_k x = b_k for the first rows and a_k x >= b_k for the others. Starting from the free minimum
x = 0, the most violated row is repeatedly added to the active set; rows whose multiplier falls to 0
are removed. The norm increases with every row, so the method ends after finitely many steps. It is
exact: equal problems have equal solutions to the last bit.

Active rows rarely change between ticks of sampled control. The rows of the previous tick are
therefore tried first, and accepted if their multipliers are positive and no row is violated.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.numerics.elementary import hypot, square

# Per finger: two force components, at most one slip row and eight inequalities. In addition: the
# wrench, and a variable for the violation if the rows contradict each other.
MAX_SIZE = 2 * MAX_FINGERS + 1
MAX_ROWS = 3 + MAX_FINGERS + 8 * MAX_FINGERS
MAX_CHANGES = 10 * MAX_ROWS
DEPENDENT = 1e-10
TOLERANCE = 1e-12

QUADRATIC = np.dtype(
    [
        ("columns", np.int64),  # length of x
        ("equalities", np.int64),
        ("rows", np.int64),  # equalities and inequalities
        ("normals", np.float64, (MAX_ROWS, MAX_SIZE)),  # a_k
        ("bounds", np.float64, (MAX_ROWS,)),  # b_k
        ("solution", np.float64, (MAX_SIZE,)),  # x
        ("count", np.int64),  # of active rows
        ("active", np.int64, (MAX_SIZE,)),
        ("multipliers", np.float64, (MAX_SIZE,)),  # of the active rows
        ("basis", np.float64, (MAX_SIZE, MAX_SIZE)),  # Q and R of their normals, by columns
        ("triangle", np.float64, (MAX_SIZE, MAX_SIZE)),
        ("parts", np.float64, (MAX_SIZE,)),  # of a normal in the basis
        ("step", np.float64, (MAX_SIZE,)),  # its remainder outside the basis
        ("slopes", np.float64, (MAX_SIZE,)),  # rates of decrease of the multipliers along the step
        # 1: try the active rows of the previous tick, and store those found. Only at ticks, so
        # that rows of the trace do not affect the motion.
        ("warm", np.int64),
        ("last_count", np.int64),
        ("last", np.int64, (MAX_SIZE,)),
    ],
    align=True,
)


@compiled_apart(types.int64, QUADRATIC)
def solve_quadratic(problem: Record) -> int:
    """Writes the least-norm point to ``solution``.

    Returns:
        1, or 0 if the rows contradict each other or equalities are dependent.
    """
    if problem.warm == 0:
        return _solve_cold(problem)
    if not _solve_as_last(problem) and _solve_cold(problem) == 0:
        problem.last_count = 0
        return 0
    problem.last_count = problem.count
    for k in range(problem.count):
        problem.last[k] = problem.active[k]
    return 1


@compiled
def _solve_as_last(problem: Record) -> bool:
    """Tries the previous active rows; True if they give the solution."""
    if not problem.equalities <= problem.last_count <= problem.columns:
        return False
    problem.count = 0
    for k in range(problem.last_count):
        row = problem.last[k]
        if row >= problem.rows or (k < problem.equalities and row != k):
            return False
        rest = _split_normal(problem, row)
        if rest == 0.0:
            return False
        _append(problem, row, 0.0, np.sqrt(rest))
    _solve_active(problem)
    for k in range(problem.equalities, problem.count):
        if not problem.multipliers[k] > 0.0:
            return False
    return _most_violated(problem) < 0


@compiled
def _solve_active(problem: Record) -> None:
    """Computes the least-norm point with equality in all active rows, and their multipliers.

    With the normals A^T = Q R: x = Q y, R^T y = b, and A^T multipliers = x.
    """
    count, triangle, y = problem.count, problem.triangle, problem.parts
    for i in range(problem.columns):
        problem.solution[i] = 0.0
    for k in range(count):
        total = problem.bounds[problem.active[k]]
        for j in range(k):
            total -= triangle[j, k] * y[j]
        y[k] = total / triangle[k, k]
        for i in range(problem.columns):
            problem.solution[i] += y[k] * problem.basis[i, k]
    for k in range(count - 1, -1, -1):
        total = y[k]
        for j in range(k + 1, count):
            total -= triangle[k, j] * problem.multipliers[j]
        problem.multipliers[k] = total / triangle[k, k]


@compiled
def _solve_cold(problem: Record) -> int:
    """Solves the problem from the free minimum; 0 if there is no solution."""
    problem.count = 0
    for i in range(problem.columns):
        problem.solution[i] = 0.0
    for row in range(problem.equalities):
        if not _enforce(problem, row):
            return 0
    for _ in range(MAX_CHANGES):
        row = _most_violated(problem)
        if row < 0:
            return 1
        if not _enforce(problem, row):
            return 0
    return 0


@compiled
def largest_violation(problem: Record) -> float:
    """Largest violation of an inequality; 0 if all are satisfied."""
    largest = 0.0
    for row in range(problem.equalities, problem.rows):
        largest = max(largest, -_excess(problem, row))
    return largest


@compiled
def _excess(problem: Record, row: int) -> float:
    """Slack of a row: a x - b."""
    total = -problem.bounds[row]
    for i in range(problem.columns):
        total += problem.normals[row, i] * problem.solution[i]
    return total


@compiled
def _most_violated(problem: Record) -> int:
    """Inequality with the largest violation, -1 if all are satisfied within rounding."""
    largest = 0.0
    for i in range(problem.columns):
        largest = max(largest, abs(problem.solution[i]))
    worst, least = -1, -TOLERANCE * (1.0 + largest)
    for row in range(problem.equalities, problem.rows):
        excess = _excess(problem, row)
        if excess < least:
            worst, least = row, excess
    return worst


@compiled
def _enforce(problem: Record, row: int) -> bool:
    """Activates a row and removes active rows whose multiplier becomes negative.

    Returns:
        True if the row is compatible with the active ones.
    """
    multiplier = 0.0
    for _ in range(MAX_SIZE + 1):
        rest = _split_normal(problem, row)
        _find_slopes(problem)
        blocking, reach = _first_to_let_go(problem)
        full = -_excess(problem, row) / rest if rest > 0.0 else np.inf
        length = min(full, reach)
        if length == np.inf:
            return False
        multiplier += length
        for k in range(problem.count):
            problem.multipliers[k] -= length * problem.slopes[k]
        if rest > 0.0:
            for i in range(problem.columns):
                problem.solution[i] += length * problem.step[i]
        if full <= reach:
            _append(problem, row, multiplier, np.sqrt(rest))
            return True
        _let_go(problem, blocking)
    return False


@compiled
def _split_normal(problem: Record, row: int) -> float:
    """Splits the normal of a row into components in the basis, ``parts``, and a rest, ``step``.

    Projecting twice keeps the basis orthogonal to rounding.

    Returns:
        The squared length of the rest; 0 if the normal depends on the active ones.
    """
    size, count = problem.columns, problem.count
    whole, rest = 0.0, 0.0
    for i in range(size):
        problem.step[i] = problem.normals[row, i]
        whole += square(problem.step[i])
    for k in range(count):
        problem.parts[k] = 0.0
    for _ in range(2):
        for k in range(count):
            part = 0.0
            for i in range(size):
                part += problem.basis[i, k] * problem.step[i]
            problem.parts[k] += part
            for i in range(size):
                problem.step[i] -= part * problem.basis[i, k]
    for i in range(size):
        rest += square(problem.step[i])
    return rest if rest > square(DEPENDENT) * whole else 0.0


@compiled
def _find_slopes(problem: Record) -> None:
    """Solves R slopes = parts."""
    for k in range(problem.count - 1, -1, -1):
        total = problem.parts[k]
        for j in range(k + 1, problem.count):
            total -= problem.triangle[k, j] * problem.slopes[j]
        problem.slopes[k] = total / problem.triangle[k, k]


@compiled
def _first_to_let_go(problem: Record) -> tuple[int, float]:
    """Active inequality whose multiplier vanishes first along the step, and the distance to it."""
    first, least = -1, np.inf
    for k in range(problem.equalities, problem.count):
        slope = problem.slopes[k]
        if slope > 0.0 and problem.multipliers[k] < least * slope:
            first, least = k, problem.multipliers[k] / slope
    return first, least


@compiled
def _append(problem: Record, row: int, multiplier: float, length: float) -> None:
    k = problem.count
    problem.active[k], problem.multipliers[k] = row, multiplier
    for j in range(k):
        problem.triangle[j, k] = problem.parts[j]
    problem.triangle[k, k] = length
    for i in range(problem.columns):
        problem.basis[i, k] = problem.step[i] / length
    problem.count = k + 1


@compiled
def _let_go(problem: Record, gone: int) -> None:
    """Removes an active row; rotations restore the triangular form of R."""
    last = problem.count - 1
    for k in range(gone, last):
        problem.active[k] = problem.active[k + 1]
        problem.multipliers[k] = problem.multipliers[k + 1]
        for j in range(k + 2):
            problem.triangle[j, k] = problem.triangle[j, k + 1]
    for k in range(gone, last):
        a, b = problem.triangle[k, k], problem.triangle[k + 1, k]
        length = hypot(a, b)
        cosine, sine = a / length, b / length
        problem.triangle[k, k] = length
        for j in range(k + 1, last):
            upper, lower = problem.triangle[k, j], problem.triangle[k + 1, j]
            problem.triangle[k, j] = cosine * upper + sine * lower
            problem.triangle[k + 1, j] = cosine * lower - sine * upper
        for i in range(problem.columns):
            left, right = problem.basis[i, k], problem.basis[i, k + 1]
            problem.basis[i, k] = cosine * left + sine * right
            problem.basis[i, k + 1] = cosine * right - sine * left
    problem.count = last
