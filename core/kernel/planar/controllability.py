"""Controllability by the joint torques in the current phase: rank and range of B~ (Eq. 18).

J_c is invertible, so B~ = [W; -D] J_c^-T has the same range as G = [W; -D of the slipping
contacts], with the true friction.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.rows import remove_parts
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.kernel.planar.wrench import assemble_rows

APART = 1e-6  # [m]


@compiled_apart(types.int64, MODEL, DISCRETE, WORKSPACE)
def find_controllable(model: Record, discrete: Record, work: Record) -> int:
    """Writes to ``work.shares`` the part of each object acceleration that torques can produce.

    The fractions are the diagonal of B~ B~^+: 1 if a coordinate can be accelerated independently
    of the others, less otherwise.

    Returns:
        The rank of B~.
    """
    if _all_stick_apart(model, discrete, work.kin):
        for k in range(3):
            work.shares[k] = 1.0
        return 3
    basis = work.room.basis
    rows = assemble_rows(work.kin, model.truth, discrete.phases, work.room)
    rank = 0
    for column in range(2 * model.num_fingers):
        rank += _keep_independent(basis, rows, rank, column)
        if rank == rows:
            break
    for k in range(3):
        share = 0.0
        for i in range(rank):
            share += square(basis[i, k])
        work.shares[k] = 1.0 if rank == rows else share
    return rank


@compiled
def _all_stick_apart(model: Record, discrete: Record, kin: Record) -> bool:
    """True if all contacts stick and two are clearly apart, so that they can exert any wrench."""
    farthest = 0.0
    for i in range(model.num_fingers):
        if discrete.phases[i] != 0:
            return False
        dx, dy = kin.arms[i, 0] - kin.arms[0, 0], kin.arms[i, 1] - kin.arms[0, 1]
        farthest = max(farthest, abs(dx), abs(dy))
    return farthest > APART


@compiled
def _keep_independent(vectors: Floats, length: int, count: int, candidate: int) -> int:
    """Makes a vector orthogonal to ``count`` orthonormal ones; appends it if independent.

    Returns:
        1 if it is independent, else 0.
    """
    rest = remove_parts(vectors, length, count, candidate)
    if rest == 0.0:
        return 0
    for k in range(length):
        vectors[count, k] = vectors[candidate, k] / np.sqrt(rest)
    return 1
