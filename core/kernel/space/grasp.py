"""The least contact forces that give a wrench and stay inside their cones.

Minimise |F|^2 where G F = d, |F_t| <= c F_n and F_n between its limits at every contact: a
second-order cone program with few free numbers. F = origin + basis lambda, |F|^2 = |origin|^2 +
|lambda|^2. Newton's method on the conditions of its active limits is exact; the limits that were
active at the tick before are tried first, then they are found one by one, then by a barrier method.
Where nothing meets all limits, the largest violation is made as small as can be.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.space.linear import factor_dense, make_rows_orthogonal, solve_dense
from slipgrasp.core.kernel.space.workspace import GRASP, MAX_FORCES

RANK_SHARE = 1e-9
FEASIBLE = 1e-10  # [N], and share of the forces
NEWTON_STEPS, NEWTON_ERROR = 30, 1e-13
MAX_CHANGES = 40
WITH_ROOM = 1e-6  # that all limits are met by to begin the way to the least forces [N]
# [1/N]: where many forces violate the limits alike, it is small ones that count.
SMALL_FORCES = 1e-8
CONE, LEAST, MOST = range(3)
WEAK, DAMPING = 0.1, 0.1  # sigma_0 and delta_0, moments over the mean arm
_GAP, _FASTER, _BARRIER_STEPS = 1e-13, 0.1, 60


@compiled_apart(types.void, GRASP, types.int64, types.int64)
def spatial_origin(grasp: Record, n: int, num_rows: int) -> None:
    """Least-norm least-squares solution of G F = d, and a basis of what is free.

    Free is what G does not see and, where the law softens, what weak rows see.
    """
    size, rows = 3 * n, grasp.rows
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
    rank = soft = 0
    for p in range(num_rows):
        if not grasp.right[p] > square(RANK_SHARE) * largest:
            continue
        rank += 1
        strength = np.sqrt(grasp.right[p])
        inverse, wanted = 1.0 / strength, rows[p, MAX_FORCES] / strength
        for k in range(size):
            rows[p, k] *= inverse
            grasp.step[k] -= square(rows[p, k])
        if grasp.softens == 1 and strength < WEAK:
            _soften(grasp, soft, p, strength, strength * wanted, size)
            soft += 1
            continue
        for k in range(size):
            grasp.origin[k] += wanted * rows[p, k]
    grasp.rank, grasp.soft, grasp.free = rank, soft, size - rank + soft
    for j in range(soft, grasp.free):
        best = 0
        for k in range(size):
            if grasp.step[k] > grasp.step[best]:
                best = k
        basis = grasp.basis[j]
        for k in range(size):
            basis[k] = 0.0
        basis[best] = 1.0
        for _ in range(2):
            for p in range(num_rows):
                if grasp.right[p] > square(RANK_SHARE) * largest:
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
    """Makes a weak row of G a free number that is drawn to what the row asks.

    Of c along the row, c^2 + (strength c - wanted)^2 / delta^2 = w^2 (c - m)^2 + const.
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
def _set_force(grasp: Record, n: int) -> None:
    """Forces at ``point``."""
    for k in range(3 * n):
        total = grasp.origin[k]
        for j in range(grasp.free):
            total += grasp.basis[j, k] * grasp.point[j]
        grasp.force[k] = total


@compiled
def _tangential(grasp: Record, i: int) -> float:
    force = grasp.force
    return np.sqrt(square(force[3 * i]) + square(force[3 * i + 1]))


@compiled
def _limit(grasp: Record, c: int) -> float:
    """How far a force is inside limit ``c`` [N]; inf where there is no such limit."""
    i, kind = c // 3, c % 3
    normal = grasp.force[3 * i + 2]
    if kind == CONE:
        if grasp.cones[i] < 0.0:
            return np.inf
        return grasp.cones[i] * normal - _tangential(grasp, i)
    return normal - grasp.least if kind == LEAST else grasp.most - normal


@compiled
def _gradient_entry(grasp: Record, c: int, k: int) -> float:
    """Derivative of limit ``c`` along force component ``k`` of its contact."""
    i, kind = c // 3, c % 3
    if kind != CONE:
        return 0.0 if k < 2 else (1.0 if kind == LEAST else -1.0)
    if k == 2:
        return grasp.cones[i]
    return -grasp.force[3 * i + k] / max(_tangential(grasp, i), 1e-300)


@compiled
def _slope(grasp: Record, c: int, j: int) -> float:
    """Derivative of limit ``c`` along free number ``j``."""
    i, total = c // 3, 0.0
    for k in range(3):
        total += _gradient_entry(grasp, c, k) * grasp.basis[j, 3 * i + k]
    return total


@compiled
def _allowed(grasp: Record, n: int) -> float:
    total = 0.0
    for k in range(3 * n):
        total += square(grasp.force[k])
    return FEASIBLE * (1.0 + np.sqrt(total))


@compiled
def _worst_limit(grasp: Record, n: int) -> int:
    """The limit violated most; -1 if none is."""
    worst, least = -1, -_allowed(grasp, n)
    for c in range(3 * n):
        value = _limit(grasp, c)
        if value < least:
            worst, least = c, value
    return worst


@compiled
def _largest_violation(grasp: Record, n: int) -> float:
    worst = _worst_limit(grasp, n)
    return -_limit(grasp, worst) if worst >= 0 else 0.0


@compiled
def _count_active(grasp: Record, n: int) -> int:
    count = 0
    for c in range(3 * n):
        count += grasp.active[c]
    return count


@compiled_apart(types.int64, GRASP, types.int64)
def spatial_follow(grasp: Record, n: int) -> int:
    """Newton's method on the conditions of the active limits; 1 if it has converged."""
    free, count = grasp.free, _count_active(grasp, n)
    if count > free:
        return 0
    for _ in range(NEWTON_STEPS):
        _set_force(grasp, n)
        size = _set_conditions(grasp, n, free)
        if not abs(factor_dense(grasp.matrix, size, grasp.order)) > 0.0:
            return 0
        solve_dense(grasp.matrix, size, grasp.order, grasp.right, grasp.step)
        moved = scale = 0.0
        for j in range(free):
            grasp.point[j] += grasp.step[j]
            moved, scale = max(moved, abs(grasp.step[j])), max(scale, abs(grasp.point[j]))
        row = free
        for c in range(3 * n):
            if grasp.active[c] == 1:
                grasp.multipliers[c] += grasp.step[row]
                row += 1
        if not moved < 1e12:
            return 0
        if moved <= NEWTON_ERROR * (1.0 + scale):
            _set_force(grasp, n)
            return 1
    return 0


@compiled
def _set_conditions(grasp: Record, n: int, free: int) -> int:
    """Matrix and right side of a Newton step for lambda and the active multipliers."""
    matrix, right = grasp.matrix, grasp.right
    for a in range(free):
        for b in range(free):
            matrix[a, b] = 1.0 if a == b else 0.0
        right[a] = -grasp.point[a]
    row = free
    for c in range(3 * n):
        if grasp.active[c] == 0:
            continue
        multiplier = grasp.multipliers[c]
        for a in range(free):
            slope = _slope(grasp, c, a)
            matrix[a, row] = -slope
            matrix[row, a] = slope
            right[a] += multiplier * slope
        for other in range(free, free + _count_active(grasp, n)):
            matrix[row, other] = 0.0
        right[row] = -_limit(grasp, c)
        if c % 3 == CONE:
            _add_curvature(grasp, c // 3, multiplier, free)
        row += 1
    return row


@compiled
def _add_curvature(grasp: Record, i: int, multiplier: float, free: int) -> None:
    """Second derivative of |F_t|, times the multiplier."""
    size = max(_tangential(grasp, i), 1e-300)
    x, y = grasp.force[3 * i] / size, grasp.force[3 * i + 1] / size
    for a in range(free):
        across = grasp.basis[a, 3 * i + 1] * x - grasp.basis[a, 3 * i] * y
        for b in range(free):
            other = grasp.basis[b, 3 * i + 1] * x - grasp.basis[b, 3 * i] * y
            grasp.matrix[a, b] += multiplier / size * across * other


@compiled
def _is_solution(grasp: Record, n: int) -> bool:
    for c in range(3 * n):
        if grasp.active[c] == 1 and not grasp.multipliers[c] >= 0.0:
            return False
    return _worst_limit(grasp, n) < 0


@compiled
def _follow_active(grasp: Record, n: int) -> int:
    """Newton from the last tick's forces and active limits; 1 if that is the solution."""
    for j in range(grasp.free):
        grasp.point[j] = grasp.trial[j]
    return 1 if spatial_follow(grasp, n) == 1 and _is_solution(grasp, n) else 0


@compiled
def _search_active(grasp: Record, n: int) -> int:
    """Takes in the limit violated most, lets go what pulls, until all hold; 1 if found."""
    for c in range(3 * n):
        grasp.active[c] = 0
        grasp.multipliers[c] = 0.0
    for j in range(grasp.free):
        grasp.point[j] = 0.0
    _set_force(grasp, n)
    for _ in range(MAX_CHANGES):
        worst = _worst_limit(grasp, n)
        if worst < 0:
            return 1
        grasp.active[worst], grasp.multipliers[worst] = 1, 0.0
        if spatial_follow(grasp, n) == 0:
            return 0
        while True:
            least, pulls = 0.0, -1
            for c in range(3 * n):
                if grasp.active[c] == 1 and grasp.multipliers[c] < least:
                    least, pulls = grasp.multipliers[c], c
            if pulls < 0:
                break
            grasp.active[pulls], grasp.multipliers[pulls] = 0, 0.0
            if spatial_follow(grasp, n) == 0:
                return 0
    return 0


@compiled
def _widened(grasp: Record, c: int, extra: float) -> float:
    """What the barrier of a limit is the logarithm of, where all limits are ``extra`` wider."""
    if c % 3 != CONE:
        return _limit(grasp, c) + extra
    i = c // 3
    if grasp.cones[i] < 0.0:
        return np.inf
    reach = grasp.cones[i] * grasp.force[3 * i + 2] + extra
    if not reach > 0.0:
        return -1.0
    return reach * reach - square(grasp.force[3 * i]) - square(grasp.force[3 * i + 1])


@compiled_apart(types.float64, GRASP, types.int64, types.float64, types.int64)
def spatial_barrier(grasp: Record, n: int, weight: float, phase: int) -> float:
    """One damped Newton step on objective / weight - sum log(limit); its decrement.

    Phase 1 makes the common widening small, phase 2 the forces.
    """
    free, force = grasp.free, grasp.force
    size = free + (1 if phase == 1 else 0)
    extra = grasp.point[free] if phase == 1 else 0.0
    matrix, right, gradient = grasp.matrix, grasp.right, grasp.gradient
    for a in range(size):
        for b in range(size):
            matrix[a, b] = 0.0
        right[a] = 0.0
        if phase == 2:
            matrix[a, a] = 1.0 / weight
            right[a] = -grasp.point[a] / weight
    if phase == 1:
        right[free] = -1.0 / weight
        for a in range(free):
            matrix[a, a] = SMALL_FORCES / weight
            right[a] = -SMALL_FORCES * grasp.point[a] / weight
    for c in range(3 * n):
        value = _widened(grasp, c, extra)
        if value == np.inf:
            continue
        i, inverse = c // 3, 1.0 / value
        is_cone = c % 3 == CONE
        reach = grasp.cones[i] * force[3 * i + 2] + extra
        for a in range(size):
            if a == free:
                gradient[a] = 2.0 * reach if is_cone else 1.0
                continue
            basis = grasp.basis[a]
            if is_cone:
                along = grasp.cones[i] * basis[3 * i + 2]
                gradient[a] = 2.0 * (
                    reach * along
                    - force[3 * i] * basis[3 * i]
                    - force[3 * i + 1] * basis[3 * i + 1]
                )
            else:
                gradient[a] = basis[3 * i + 2] if c % 3 == LEAST else -basis[3 * i + 2]
        for a in range(size):
            right[a] += inverse * gradient[a]
            for b in range(size):
                matrix[a, b] += inverse * inverse * gradient[a] * gradient[b]
                if is_cone:
                    matrix[a, b] -= inverse * _cone_curvature(grasp, i, a, b)
    factor_dense(matrix, size, grasp.order)
    for a in range(size):
        gradient[a] = right[a]
    solve_dense(matrix, size, grasp.order, right, grasp.step)
    decrement = 0.0
    for a in range(size):
        decrement += gradient[a] * grasp.step[a]
        grasp.trial[a] = grasp.point[a]
    share = 1.0 if decrement < 0.25 else 1.0 / (1.0 + np.sqrt(max(decrement, 0.0)))
    for _ in range(60):
        for a in range(size):
            grasp.point[a] = grasp.trial[a] + share * grasp.step[a]
        _set_force(grasp, n)
        if _is_inside(grasp, n, grasp.point[free] if phase == 1 else 0.0):
            return decrement
        share *= 0.5
    for a in range(size):
        grasp.point[a] = grasp.trial[a]
    _set_force(grasp, n)
    return 0.0


@compiled
def _cone_curvature(grasp: Record, i: int, a: int, b: int) -> float:
    """Second derivative of (c F_n + extra)^2 - |F_t|^2."""
    free, cone = grasp.free, grasp.cones[i]
    first = 1.0 if a == free else cone * grasp.basis[a, 3 * i + 2]
    second = 1.0 if b == free else cone * grasp.basis[b, 3 * i + 2]
    total = 2.0 * first * second
    if a < free and b < free:
        for k in range(2):
            total -= 2.0 * grasp.basis[a, 3 * i + k] * grasp.basis[b, 3 * i + k]
    return total


@compiled
def _is_inside(grasp: Record, n: int, extra: float) -> bool:
    for c in range(3 * n):
        if not _widened(grasp, c, extra) > 0.0:
            return False
    return True


@compiled
def _minimise_violation(grasp: Record, n: int) -> float:
    """Makes the largest violation small; stops where all limits are met with room to spare."""
    for j in range(grasp.free):
        grasp.point[j] = 0.0
    _set_force(grasp, n)
    largest = 0.0
    for c in range(3 * n):
        value = _limit(grasp, c)
        if value < np.inf:
            largest = max(largest, -value)
    grasp.point[grasp.free] = 1.5 * largest + 1.0
    weight = 1.0
    while weight > _GAP:
        for _ in range(_BARRIER_STEPS):
            decrement = spatial_barrier(grasp, n, weight, 1)
            if grasp.point[grasp.free] < -WITH_ROOM:
                return grasp.point[grasp.free]
            if decrement < 1e-9:
                break
        weight *= _FASTER
    return grasp.point[grasp.free]


@compiled
def _descend(grasp: Record, n: int) -> None:
    """From forces inside all limits to the least ones."""
    # From a weight that the objective does not feel yet: Newton's method then never falls behind.
    weight = 1.0
    for j in range(grasp.free):
        weight += square(grasp.point[j])
    weight /= _FASTER
    while weight > _GAP:
        weight *= _FASTER
        for _ in range(_BARRIER_STEPS):
            if spatial_barrier(grasp, n, weight, 2) < 1e-9:
                break
    for c in range(3 * n):
        value = _limit(grasp, c)
        room = value if c % 3 != CONE else _widened(grasp, c, 0.0)
        factor = 1.0
        if c % 3 == CONE and value < np.inf:
            reach = grasp.cones[c // 3] * grasp.force[3 * (c // 3) + 2]
            factor = reach + _tangential(grasp, c // 3)
        grasp.multipliers[c] = weight * factor / room if room < np.inf else 0.0
        grasp.active[c] = 1 if grasp.multipliers[c] > value else 0


@compiled
def _polish(grasp: Record, n: int) -> int:
    """Newton from what the barrier has found; what that does not better is kept."""
    for j in range(grasp.free):
        grasp.trial[j] = grasp.point[j]
    if spatial_follow(grasp, n) == 1 and _is_solution(grasp, n):
        return 1
    for j in range(grasp.free):
        grasp.point[j] = grasp.trial[j]
    _set_force(grasp, n)
    return 0


@compiled_apart(types.float64, GRASP, types.int64, types.int64, types.int64)
def spatial_grasp(grasp: Record, n: int, num_rows: int, least_force: int) -> float:
    """Solves the program; the forces are left in ``force``.

    Args:
        grasp: With G and d in ``rows`` and the limits.
        n: Fingers.
        num_rows: Rows of G.
        least_force: 0 where only the least-norm solution of G F = d is wanted.

    Returns:
        By how much the limits are violated at the most [N]; 0 if all are met.
    """
    spatial_origin(grasp, n, num_rows)
    for j in range(grasp.free):
        grasp.trial[j] = grasp.point[j] = 0.0
        along = length = 0.0
        for k in range(3 * n):
            along += grasp.basis[j, k] * (grasp.force[k] - grasp.origin[k])
            length += square(grasp.basis[j, k])
        grasp.trial[j] = along / length
    _set_force(grasp, n)
    if least_force == 0 or grasp.free == 0 or _worst_limit(grasp, n) < 0:
        grasp.warm = 0
        return max(_largest_violation(grasp, n), 0.0) if least_force == 1 else 0.0
    if grasp.warm == 1 and _follow_active(grasp, n) == 1:
        return 0.0
    if _search_active(grasp, n) == 1:
        grasp.warm = 1
        return 0.0
    grasp.warm = 0
    violation = _minimise_violation(grasp, n)
    if violation > FEASIBLE:
        return violation
    _descend(grasp, n)
    if _polish(grasp, n) == 1:
        grasp.warm = 1
    return 0.0
