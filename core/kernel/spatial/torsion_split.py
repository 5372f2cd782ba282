"""Distribution of undetermined moments among contacts (docs/space.md, Soft fingertips).

The moments oppose the spin of their mode and are the smallest without spin. If a contact would
exceed its friction, other contacts take over as much of its moment as they can hold: with the
amounts a of the modes, a_c due to spin, the excess x_i of the friction of contact i, and the
softness k, the amounts minimise

    |a - a_c|^2 / 2 + sum max(0, x_i)^2 / 2 k.

This is convex, so that they change without jumps.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import STATE
from slipgrasp.core.kernel.spatial.torsion_equations import spin_of
from slipgrasp.core.kernel.spatial.torsion_modes import find_reliefs
from slipgrasp.core.kernel.spatial.ways import size_with_spin
from slipgrasp.core.kernel.spatial.workspace import WORKSPACE

CREEP = 3e-9  # e psi' of undetermined modes per F_tau / e [m/(N s)]
SPARE = 1e-3  # fraction of its friction that a relieved contact at rest keeps in reserve
FASTEST_RELIEVED = 1e-9  # e psi' against friction above which there is no reserve [m/s]
SOFTNESS = 1e-6  # k
SPLIT_TRIALS, LEAST_SHARE, SPLIT_ERROR = 60, 1e-6, 1e-12  # of Newton's method


@compiled
def set_creep(model: Record, state: Record, work: Record) -> None:
    """Sets the moments of the undetermined modes, opposite to their spin."""
    torsion = work.torsion
    for mode in range(torsion.num_determined, torsion.num_holders):
        spin = 0.0
        for k in range(torsion.num_holders):
            i = torsion.holders[k]
            spin += torsion.modes[k, mode] * spin_of(model, state, work, i)
        torsion.amounts[mode] = -spin / CREEP


@compiled_apart(types.int64, MODEL, STATE, WORKSPACE)
def spatial_relieve(model: Record, state: Record, work: Record) -> int:
    """Changes undetermined moments so that no contact exceeds its friction, if possible.

    Args:
        model: Constants of the run.
        state: State, with the velocities.
        work: Amounts of the modes, which change, and corresponding forces.

    Returns:
        1 if the amounts have changed.
    """
    torsion = work.torsion
    first, count = torsion.num_determined, torsion.num_holders
    if not _some_exceed(model, state, work):
        return 0
    find_reliefs(model, work)
    for mode in range(first, count):
        torsion.shift[mode] = torsion.step[mode] = 0.0
    least, share = np.inf, 1.0
    for _ in range(SPLIT_TRIALS):
        loss = _evaluate_split(work, share)
        if loss > least and share > LEAST_SHARE:
            share *= 0.5
            continue
        least = loss
        if _improve_split(work, share) <= SPLIT_ERROR:
            break
        share = 1.0
    for mode in range(first, count):
        torsion.amounts[mode] += torsion.shift[mode] + torsion.step[mode]
    return 1


@compiled
def _some_exceed(model: Record, state: Record, work: Record) -> bool:
    """True if a contact exceeds its friction less the reserve; also sets ``most``."""
    torsion, found = work.torsion, False
    for k in range(torsion.num_holders):
        i = torsion.holders[k]
        x, y, moment = work.forces[i, 0], work.forces[i, 1], work.moments[i]
        size = size_with_spin(x, y, moment)
        # Contacts that relieve one that turns against its friction push it on: the faster it
        # turns, the smaller is its reserve.
        opposed = -moment * spin_of(model, state, work, i)
        speed = opposed / size if opposed > 0.0 else 0.0
        share = 1.0 - SPARE + SPARE * speed / FASTEST_RELIEVED
        torsion.most[k] = share * model.truth.static_friction[i]
        found = found or size > torsion.most[k] * work.forces[i, 2]
    return found


@compiled
def _evaluate_split(work: Record, share: float) -> float:
    """Returns the minimised function after ``share`` of ``step``.

    Its second and negative first derivatives are in ``small`` and ``small_right``.
    """
    torsion = work.torsion
    first, size = torsion.num_determined, torsion.num_holders - torsion.num_determined
    loss = 0.0
    for a in range(size):
        amount = torsion.shift[first + a] + share * torsion.step[first + a]
        loss += amount * amount
        torsion.small_right[a] = -amount
        for b in range(size):
            torsion.small[a, b] = 1.0 if a == b else 0.0
    for k in range(torsion.num_holders):
        loss += _add_excess(work, k, first, size, share) / SOFTNESS
    return loss


@compiled
def _add_excess(work: Record, k: int, first: int, size: int, share: float) -> float:
    """Adds the derivatives of the excess of the k-th holder; returns its square."""
    torsion, i = work.torsion, work.torsion.holders[k]
    reliefs, most, matrix, right = (
        torsion.reliefs[k],
        torsion.most[k],
        torsion.small,
        torsion.small_right,
    )
    x, y, z, normal = work.forces[i, 0], work.forces[i, 1], work.moments[i], work.forces[i, 2]
    for a in range(size):
        by, amount = reliefs[first + a], torsion.shift[first + a] + share * torsion.step[first + a]
        x, y, z = x + amount * by[0], y + amount * by[1], z + amount * by[2]
        normal += amount * by[3]
    friction = size_with_spin(x, y, z)
    excess = friction - most * normal
    if not (excess > 0.0 and friction > 0.0):
        return 0.0
    x, y, z = x / friction, y / friction, z / friction
    for a in range(size):
        by = reliefs[first + a]
        along = x * by[0] + y * by[1] + z * by[2]
        slope = (along - most * by[3]) / SOFTNESS
        right[a] -= excess * slope
        for b in range(size):
            to = reliefs[first + b]
            beside = x * to[0] + y * to[1] + z * to[2]
            bend = by[0] * to[0] + by[1] * to[1] + by[2] * to[2] - along * beside
            matrix[a, b] += slope * (beside - most * to[3])
            matrix[a, b] += excess * bend / friction / SOFTNESS
    return excess * excess


@compiled
def _improve_split(work: Record, share: float) -> float:
    """Takes ``share`` of ``step``, and computes the next one by Newton's method.

    Returns:
        The largest part of the step, relative to the amounts and 1 N.
    """
    torsion = work.torsion
    first, size = torsion.num_determined, torsion.num_holders - torsion.num_determined
    factor_dense(torsion.small, size, torsion.small_order)
    solve_dense(torsion.small, size, torsion.small_order, torsion.small_right, torsion.right)
    largest, scale = 0.0, 1.0
    for a in range(size):
        torsion.shift[first + a] += share * torsion.step[first + a]
        torsion.step[first + a] = torsion.right[a]
        scale = max(scale, abs(torsion.shift[first + a]))
        largest = max(largest, abs(torsion.step[first + a]))
    return largest / scale
