"""Smallest contact forces that produce a wrench and are inside their cones.

Minimise |F|^2 subject to G F = d, |F_t| <= c F_n (in the pyramid |F_x|, |F_y| <= c F_n) and limits
of F_n at every contact: a second-order cone program with few variables. For soft fingertips the
moments are additional components, |(F_x, F_y, F_tau / e)| <= c F_n. With F = origin + basis lambda,
|F|^2 = |origin|^2 + |lambda|^2. Newton's method on the optimality conditions of the active limits
is exact. The active limits of the previous tick are tried first, then limits are added one by one,
then a barrier method is used. If no forces meet all limits, the largest violation is minimized.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.dense import (
    factor_dense,
    make_rows_orthogonal,
    make_rows_orthonormal,
    solve_dense,
)
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.grasp_barrier import descend, minimise_violation
from slipgrasp.core.kernel.spatial.grasp_limits import (
    FEASIBLE,
    FRICTION,
    PER_CONTACT,
    allowed,
    exists,
    gradient_of,
    limit,
    part_at,
    set_force,
    slope_of_limit,
    tangential,
)
from slipgrasp.core.kernel.spatial.workspace import GRASP, MAX_ASKED

RANK_SHARE = 1e-9
NEWTON_STEPS = 30
SHORT = 1e-8  # relative size of the last Newton step; the error is of the order of its square
MAX_CHANGES = 40
WEAK, DAMPING = 0.1, 0.1  # sigma_0 and delta_0, for moments divided by the mean arm


@compiled_apart(types.void, GRASP, types.int64, types.int64)
def spatial_origin(grasp: Record, n: int, num_rows: int) -> None:
    """Computes the least-norm least-squares solution of G F = d, and a basis of free forces.

    Free forces are the null space of G and, with a softened distribution, directions of weak rows.
    """
    size, rows = grasp.size, grasp.rows
    plain = grasp.softens == 0 and make_rows_orthonormal(rows, num_rows, size, grasp.matrix)
    if not plain:
        make_rows_orthogonal(rows, num_rows, size)
    largest = 0.0
    for p in range(num_rows):
        total = 0.0
        for k in range(size):
            total += rows[p, k] * rows[p, k]
        grasp.right[p] = total
        largest = max(largest, total)
    for k in range(size):
        grasp.origin[k] = 0.0
        grasp.step[k] = 1.0
    rank, soft, least = 0, 0, square(RANK_SHARE) * largest
    for p in range(num_rows):
        if not grasp.right[p] > least:
            continue
        rank += 1
        strength = np.sqrt(grasp.right[p])
        inverse, wanted = 1.0 / strength, rows[p, MAX_ASKED] / strength
        for k in range(size):
            rows[p, k] *= inverse
            grasp.step[k] -= square(rows[p, k])
        if grasp.softens == 1 and square(strength / WEAK) < 1.0:
            _soften(grasp, soft, p, strength, strength * wanted, size)
            soft += 1
            continue
        for k in range(size):
            grasp.origin[k] += wanted * rows[p, k]
    grasp.rank, grasp.weak, grasp.free = rank, soft, size - rank + soft
    for j in range(soft, grasp.free):
        best = 0
        for k in range(size):
            if grasp.step[k] > grasp.step[best]:
                best = k
        basis = grasp.basis[j]
        for k in range(size):
            basis[k] = 0.0
        basis[best] = 1.0
        # One projection is enough: at least 1 / 3n of the squared length of this vector remains.
        for p in range(num_rows):
            if grasp.right[p] > least:
                _remove(basis, rows[p], size)
        for earlier in range(soft, j):
            _remove(basis, grasp.basis[earlier], size)
        total = 0.0
        for k in range(size):
            total += basis[k] * basis[k]
        inverse = 1.0 / np.sqrt(total)
        for k in range(size):
            basis[k] *= inverse
            grasp.step[k] -= square(basis[k])


@compiled
def _soften(grasp: Record, j: int, p: int, strength: float, wanted: float, size: int) -> None:
    """Replaces a weak row of G with a free variable with a penalty on the residual of the row.

    With c along the row, c^2 + (strength c - wanted)^2 / delta^2 = w^2 (c - m)^2 + const.
    """
    delta = square(DAMPING) * (1.0 - square(strength / WEAK))
    weight = np.sqrt(1.0 + square(strength) / delta)
    middle = strength * wanted / (delta * square(weight))
    for k in range(size):
        grasp.origin[k] += middle * grasp.rows[p, k]
        grasp.basis[j, k] = grasp.rows[p, k] / weight


@compiled
def _remove(vector: np.ndarray, unit: np.ndarray, size: int) -> None:
    part = 0.0
    for k in range(size):
        part += vector[k] * unit[k]
    for k in range(size):
        vector[k] -= part * unit[k]


@compiled
def _worst_limit(grasp: Record, n: int) -> int:
    """Limit with the largest violation; -1 if there is none."""
    worst, least = -1, -allowed(grasp, n)
    for c in range(PER_CONTACT * n):
        value = limit(grasp, c)
        if not value >= least:  # true for NaN
            worst, least = c, value
    return worst


@compiled
def _largest_violation(grasp: Record, n: int) -> float:
    worst = _worst_limit(grasp, n)
    return -limit(grasp, worst) if worst >= 0 else 0.0


@compiled
def _count_active(grasp: Record, n: int) -> int:
    count = 0
    for c in range(PER_CONTACT * n):
        count += grasp.active[c]
    return count


@compiled_apart(types.int64, GRASP, types.int64)
def spatial_follow(grasp: Record, n: int) -> int:
    """Runs Newton's method on the conditions of the active limits; 1 if it has converged."""
    free, count = grasp.free, _count_active(grasp, n)
    if count > free:
        return 0
    for _ in range(NEWTON_STEPS):
        set_force(grasp, n)
        size = _set_conditions(grasp, n, free)
        if not abs(factor_dense(grasp.matrix, size, grasp.order)) > 0.0:
            return 0
        solve_dense(grasp.matrix, size, grasp.order, grasp.right, grasp.step)
        moved = scale = total = 0.0
        for j in range(free):
            grasp.point[j] += grasp.step[j]
            moved, scale = max(moved, abs(grasp.step[j])), max(scale, abs(grasp.point[j]))
            total += abs(grasp.step[j])
        row = free
        for c in range(PER_CONTACT * n):
            if grasp.active[c] == 1:
                grasp.multipliers[c] += grasp.step[row]
                row += 1
        if not total < 1e12:  # max ignores NaN, the sum does not
            return 0
        if moved <= SHORT * (1.0 + scale):
            set_force(grasp, n)
            return 1
    return 0


@compiled
def _set_conditions(grasp: Record, n: int, free: int) -> int:
    """Sets matrix and right side of a Newton step for lambda and the active multipliers."""
    matrix, right = grasp.matrix, grasp.right
    for a in range(free):
        for b in range(free):
            matrix[a, b] = 1.0 if a == b else 0.0
        right[a] = -grasp.point[a]
    row, end = free, free + _count_active(grasp, n)
    for c in range(PER_CONTACT * n):
        if grasp.active[c] == 0:
            continue
        multiplier, gradient = grasp.multipliers[c], gradient_of(grasp, c)
        for a in range(free):
            slope = slope_of_limit(grasp, c, gradient, a)
            matrix[a, row] = -slope
            matrix[row, a] = slope
            right[a] += multiplier * slope
        for other in range(free, end):
            matrix[row, other] = 0.0
        right[row] = -limit(grasp, c)
        if c % PER_CONTACT == FRICTION and grasp.ways == 1:
            _add_curvature(grasp, c // PER_CONTACT, multiplier, free)
        row += 1
    return row


@compiled
def _add_curvature(grasp: Record, i: int, multiplier: float, free: int) -> None:
    """Adds the second derivative of |F_t| times the multiplier."""
    size = max(tangential(grasp, i, 0), 1e-300)
    if grasp.soft == 1:
        _add_curvature_of_ball(grasp, i, multiplier / size, size, free)
        return
    x, y = grasp.force[3 * i] / size, grasp.force[3 * i + 1] / size
    for a in range(free):
        across = grasp.basis[a, 3 * i + 1] * x - grasp.basis[a, 3 * i] * y
        for b in range(free):
            other = grasp.basis[b, 3 * i + 1] * x - grasp.basis[b, 3 * i] * y
            grasp.matrix[a, b] += multiplier / size * across * other


@compiled
def _add_curvature_of_ball(grasp: Record, i: int, factor: float, size: float, free: int) -> None:
    """As `_add_curvature`, for friction with three components."""
    for a in range(free):
        for b in range(free):
            total = along = other = 0.0
            for part in range(3):
                k = part_at(grasp, i, part)
                total += grasp.basis[a, k] * grasp.basis[b, k]
                along += grasp.basis[a, k] * grasp.force[k]
                other += grasp.basis[b, k] * grasp.force[k]
            grasp.matrix[a, b] += factor * (total - along / size * (other / size))


@compiled
def _is_solution(grasp: Record, n: int) -> bool:
    for c in range(PER_CONTACT * n):
        if grasp.active[c] == 1 and not grasp.multipliers[c] >= 0.0:
            return False
    return _worst_limit(grasp, n) < 0


@compiled
def _follow_active(grasp: Record, n: int) -> int:
    """Runs Newton's method from the forces and active limits of the previous tick; 1 on success.

    The cones of contacts that have begun to slip are removed from these limits.
    """
    for j in range(grasp.free):
        grasp.point[j] = grasp.trial[j]
    for c in range(PER_CONTACT * n):
        if not exists(grasp, c):
            grasp.active[c] = 0
    return 1 if spatial_follow(grasp, n) == 1 and _is_solution(grasp, n) else 0


@compiled
def _search_active(grasp: Record, n: int) -> int:
    """Adds the most violated limit and drops limits with negative multipliers; 1 on success."""
    for c in range(PER_CONTACT * n):
        grasp.active[c] = 0
        grasp.multipliers[c] = 0.0
    for j in range(grasp.free):
        grasp.point[j] = 0.0
    set_force(grasp, n)
    for _ in range(MAX_CHANGES):
        worst = _worst_limit(grasp, n)
        if worst < 0:
            return 1
        grasp.active[worst], grasp.multipliers[worst] = 1, 0.0
        if spatial_follow(grasp, n) == 0:
            return 0
        while True:
            least, pulls = 0.0, -1
            for c in range(PER_CONTACT * n):
                if grasp.active[c] == 1 and grasp.multipliers[c] < least:
                    least, pulls = grasp.multipliers[c], c
            if pulls < 0:
                break
            grasp.active[pulls], grasp.multipliers[pulls] = 0, 0.0
            if spatial_follow(grasp, n) == 0:
                return 0
    return 0


@compiled
def _polish(grasp: Record, n: int) -> int:
    """Refines the result of the barrier method by Newton's method; 1 on success.

    If this fails, the result of the barrier method is restored.
    """
    for j in range(grasp.free):
        grasp.trial[j] = grasp.point[j]
    if spatial_follow(grasp, n) == 1 and _is_solution(grasp, n):
        return 1
    for j in range(grasp.free):
        grasp.point[j] = grasp.trial[j]
    set_force(grasp, n)
    return 0


@compiled_apart(types.float64, GRASP, types.int64, types.int64, types.int64)
def spatial_grasp(grasp: Record, n: int, num_rows: int, least_force: int) -> float:
    """Solves the program and writes the forces to ``force``.

    Args:
        grasp: Program, with G and d in ``rows``, and limits.
        n: Number of fingers.
        num_rows: Number of rows of G.
        least_force: 0 to compute only the least-norm solution of G F = d.

    Returns:
        The largest violation of a limit [N]; 0 if all are met.
    """
    spatial_origin(grasp, n, num_rows)
    for j in range(grasp.free):
        grasp.trial[j] = grasp.point[j] = 0.0
        along = length = 0.0
        for k in range(grasp.size):
            along += grasp.basis[j, k] * (grasp.force[k] - grasp.origin[k])
            length += square(grasp.basis[j, k])
        grasp.trial[j] = along / length
    set_force(grasp, n)
    if least_force == 0 or grasp.free == 0 or _worst_limit(grasp, n) < 0:
        grasp.warm = 0
        return max(_largest_violation(grasp, n), 0.0) if least_force == 1 else 0.0
    if grasp.warm == 1 and _follow_active(grasp, n) == 1:
        return 0.0
    if _search_active(grasp, n) == 1:
        grasp.warm = 1
        return 0.0
    grasp.warm = 0
    violation = minimise_violation(grasp, n)
    if violation > FEASIBLE:
        return violation
    descend(grasp, n)
    if _polish(grasp, n) == 1:
        grasp.warm = 1
    return 0.0
