"""Smallest contact forces by a barrier method, used if the active limits are not found otherwise.

If no forces meet all limits, the largest violation is minimized.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.grasp_limits import (
    LEAST,
    PER_CONTACT,
    limit,
    part_at,
    set_force,
    tangential,
)
from slipgrasp.core.kernel.spatial.ways import parts_of_way
from slipgrasp.core.kernel.spatial.workspace import GRASP

WITH_ROOM = 1e-6  # margin of all limits at the start of the minimization of the forces [N]
# [1/N]: among forces with equal violation, small ones are preferred.
SMALL_FORCES = 1e-8
_GAP, _FASTER, _BARRIER_STEPS = 1e-13, 0.1, 60


@compiled
def widened(grasp: Record, c: int, extra: float) -> float:
    """Argument of the logarithmic barrier of limit ``c``, with limits widened by ``extra`` [N]."""
    i, kind = c // PER_CONTACT, c % PER_CONTACT
    if kind >= LEAST:
        return limit(grasp, c) + extra
    if grasp.cones[i, kind] < 0.0:
        return np.inf
    reach = grasp.cones[i, kind] * grasp.force[3 * i + 2] + extra
    if not reach > 0.0:
        return -1.0
    room = reach * reach
    for part in parts_of_way(grasp, kind):
        room -= square(grasp.force[part_at(grasp, i, part)])
    return room


@compiled_apart(types.float64, GRASP, types.int64, types.float64, types.int64)
def spatial_barrier(grasp: Record, n: int, weight: float, phase: int) -> float:
    """Takes a damped Newton step on objective / weight - sum log(limit); returns its decrement.

    Phase 1 minimizes the common widening of the limits, phase 2 the forces.
    """
    free = grasp.free
    size = free + (1 if phase == 1 else 0)
    extra = grasp.point[free] if phase == 1 else 0.0
    _begin_system(grasp, size, weight, phase)
    for c in range(PER_CONTACT * n):
        value = widened(grasp, c, extra)
        if value < np.inf:
            _add_limit(grasp, c, size, extra, 1.0 / value)
    factor_dense(grasp.matrix, size, grasp.order)
    for a in range(size):
        grasp.gradient[a] = grasp.right[a]
    solve_dense(grasp.matrix, size, grasp.order, grasp.right, grasp.step)
    decrement = 0.0
    for a in range(size):
        decrement += grasp.gradient[a] * grasp.step[a]
        grasp.trial[a] = grasp.point[a]
    return decrement if _step_inside(grasp, n, size, decrement, phase) else 0.0


@compiled
def _begin_system(grasp: Record, size: int, weight: float, phase: int) -> None:
    """Initializes the Newton equations with the objective."""
    matrix, right, free = grasp.matrix, grasp.right, grasp.free
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


@compiled
def _add_limit(grasp: Record, c: int, size: int, extra: float, inverse: float) -> None:
    """Adds the barrier of limit ``c``; ``inverse`` is the reciprocal of its argument."""
    matrix, right, gradient = grasp.matrix, grasp.right, grasp.gradient
    for a in range(size):
        gradient[a] = _barrier_slope(grasp, c, a, extra)
    for a in range(size):
        right[a] += inverse * gradient[a]
        for b in range(size):
            matrix[a, b] += inverse * inverse * gradient[a] * gradient[b]
            if c % PER_CONTACT < LEAST:
                matrix[a, b] -= inverse * _cone_curvature(grasp, c, a, b)


@compiled
def _barrier_slope(grasp: Record, c: int, a: int, extra: float) -> float:
    """Derivative of the argument of the barrier of limit ``c``."""
    i, kind, force = c // PER_CONTACT, c % PER_CONTACT, grasp.force
    if kind >= LEAST:
        if a == grasp.free:
            return 1.0
        return grasp.basis[a, 3 * i + 2] if kind == LEAST else -grasp.basis[a, 3 * i + 2]
    reach = grasp.cones[i, kind] * force[3 * i + 2] + extra
    if a == grasp.free:
        return 2.0 * reach
    basis = grasp.basis[a]
    slope = reach * (grasp.cones[i, kind] * basis[3 * i + 2])
    for part in parts_of_way(grasp, kind):
        k = part_at(grasp, i, part)
        slope -= force[k] * basis[k]
    return 2.0 * slope


@compiled
def _step_inside(grasp: Record, n: int, size: int, decrement: float, phase: int) -> bool:
    """Takes the step, shortened until all limits are met; False, without a step, on failure."""
    share = 1.0 if decrement < 0.25 else 1.0 / (1.0 + np.sqrt(max(decrement, 0.0)))
    for _ in range(60):
        for a in range(size):
            grasp.point[a] = grasp.trial[a] + share * grasp.step[a]
        set_force(grasp, n)
        if _is_inside(grasp, n, grasp.point[grasp.free] if phase == 1 else 0.0):
            return True
        share *= 0.5
    for a in range(size):
        grasp.point[a] = grasp.trial[a]
    set_force(grasp, n)
    return False


@compiled
def _cone_curvature(grasp: Record, c: int, a: int, b: int) -> float:
    """Second derivative of (c F_n + extra)^2 - |F_t|^2."""
    i, way, free = c // PER_CONTACT, c % PER_CONTACT, grasp.free
    cone = grasp.cones[i, way]
    first = 1.0 if a == free else cone * grasp.basis[a, 3 * i + 2]
    second = 1.0 if b == free else cone * grasp.basis[b, 3 * i + 2]
    total = 2.0 * first * second
    if a < free and b < free:
        for part in parts_of_way(grasp, way):
            k = part_at(grasp, i, part)
            total -= 2.0 * grasp.basis[a, k] * grasp.basis[b, k]
    return total


@compiled
def _is_inside(grasp: Record, n: int, extra: float) -> bool:
    for c in range(PER_CONTACT * n):
        if not widened(grasp, c, extra) > 0.0:
            return False
    return True


@compiled
def minimise_violation(grasp: Record, n: int) -> float:
    """Minimizes and returns the largest violation; stops once all limits are met with a margin."""
    for j in range(grasp.free):
        grasp.point[j] = 0.0
    set_force(grasp, n)
    largest = 0.0
    for c in range(PER_CONTACT * n):
        value = limit(grasp, c)
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
def descend(grasp: Record, n: int) -> None:
    """Minimizes the forces, starting inside all limits."""
    # The initial weight makes the objective negligible, so that every Newton solution is close.
    weight = 1.0
    for j in range(grasp.free):
        weight += square(grasp.point[j])
    weight /= _FASTER
    while weight > _GAP:
        weight *= _FASTER
        for _ in range(_BARRIER_STEPS):
            if spatial_barrier(grasp, n, weight, 2) < 1e-9:
                break
    for c in range(PER_CONTACT * n):
        value = limit(grasp, c)
        i, kind = c // PER_CONTACT, c % PER_CONTACT
        room, factor = value, 1.0
        if kind < LEAST and value < np.inf:
            reach = grasp.cones[i, kind] * grasp.force[3 * i + 2]
            room, factor = widened(grasp, c, 0.0), reach + tangential(grasp, i, kind)
        grasp.multipliers[c] = weight * factor / room if room < np.inf else 0.0
        grasp.active[c] = 1 if grasp.multipliers[c] > value else 0
