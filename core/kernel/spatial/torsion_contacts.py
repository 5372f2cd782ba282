"""Forces of soft contacts that may stick or slip.

The semi-smooth Newton method of `slipgrasp.core.kernel.spatial.contact_problem` with four rows per
contact: friction is bounded by a ball in (F_x, F_y, F_tau / e), so that its three rows have the
same step size.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.newton import make_newton
from slipgrasp.core.kernel.spatial.torsion_layout import (
    FREE,
    MOVING,
    NORMAL,
    ROWS,
    TORSION,
    TURN,
)
from slipgrasp.core.kernel.spatial.ways import size_with_spin

SPLIT = 1e-9  # relative mobility added to moments in Newton's matrix


@compiled
def contact_mobility(torsion: Record, i: int) -> float:
    """Largest mobility of contact ``i`` along its tangents and about its normal."""
    first, largest = ROWS * i, 0.0
    for row in range(NORMAL):
        largest = max(largest, torsion.mobility[first + row, first + row])
    return largest


@compiled
def _mobility(torsion: Record, a: int, b: int) -> float:
    """Entry of G, including the penalty that keeps given moments."""
    turns = a % ROWS == TURN and b % ROWS == TURN
    creep = torsion.creep[a // ROWS, b // ROWS] if turns else 0.0
    return torsion.mobility[a, b] + creep


@compiled
def _change(torsion: Record, a: int, b: int) -> float:
    """Entry of Newton's matrix, with a small mobility added to moments.

    Undetermined moments therefore keep their initial values.
    """
    split = SPLIT * torsion.mobility[a - TURN, a - TURN] if a == b and a % ROWS == TURN else 0.0
    return _mobility(torsion, a, b) + split


@compiled
def _set_row_at_rest(n: int, torsion: Record, a: int, scale: float) -> None:
    """Sets the equation w = 0."""
    for b in range(ROWS * n):
        torsion.matrix[a, b] = scale * _change(torsion, a, b)
    torsion.right[a] = -scale * torsion.opening[a]


@compiled
def _set_row_of_force(n: int, torsion: Record, a: int, wanted: float) -> None:
    """Sets the equation of a force with a given value."""
    for b in range(ROWS * n):
        torsion.matrix[a, b] = 0.0
    torsion.matrix[a, a] = 1.0
    torsion.right[a] = wanted - torsion.force[a]


@compiled
def _set_rows(model: Record, slides: Floats, torsion: Record, i: int) -> None:
    """Sets the rows of Newton's matrix for contact ``i``, and the negative residuals [N]."""
    n, first, kind = model.num_fingers, ROWS * i, torsion.kinds[i]
    scale = 1.0 / contact_mobility(torsion, i)
    _set_row_at_rest(n, torsion, first + NORMAL, scale)
    if kind == MOVING:
        friction, normal = model.truth.friction[i], torsion.force[first + NORMAL]
        for row in range(NORMAL):
            part = friction * slides[i, row]
            _set_row_of_force(n, torsion, first + row, -part * normal)
            torsion.matrix[first + row, first + NORMAL] = part
    elif kind == FREE:
        _set_rows_of_ball(n, torsion, i, scale)
    else:
        for row in range(NORMAL):
            _set_row_at_rest(n, torsion, first + row, scale)
    if model.hand.eccentricities[i] == 0.0:
        _set_row_of_force(n, torsion, first + TURN, 0.0)


@compiled
def _set_rows_of_ball(n: int, torsion: Record, i: int, scale: float) -> None:
    """Sets the equations of a free contact: lambda = proj(lambda - rho w_t), |lambda| <= mu F_n."""
    first, matrix, force, opening = ROWS * i, torsion.matrix, torsion.force, torsion.opening
    normal, mu = force[first + NORMAL], torsion.bounds[i]
    y = (
        force[first] - scale * opening[first],
        force[first + 1] - scale * opening[first + 1],
        force[first + 2] - scale * opening[first + 2],
    )
    length, radius = size_with_spin(y[0], y[1], y[2]), mu * max(normal, 0.0)
    if length <= radius:
        for row in range(NORMAL):
            _set_row_at_rest(n, torsion, first + row, scale)
        return
    ratio = radius / length
    for row in range(NORMAL):
        a, e = first + row, y[row] / length
        for b in range(ROWS * n):
            along = 0.0
            for other in range(NORMAL):
                along += y[other] / length * _change(torsion, first + other, b)
            matrix[a, b] = scale * ratio * (_change(torsion, a, b) - e * along)
        for other in range(NORMAL):
            same = 1.0 if row == other else 0.0
            matrix[a, first + other] += same - ratio * (same - e * y[other] / length)
        if normal > 0.0:
            matrix[a, first + NORMAL] -= mu * e
        torsion.right[a] = -(force[a] - radius * e)


_newton = make_newton(ROWS, _mobility, _set_rows)


@compiled_apart(types.int64, MODEL, TORSION)
def spatial_soft_newton(model: Record, torsion: Record) -> int:
    """Runs Newton's method from the forces in ``torsion``; 1 if it has converged.

    Args:
        model: Constants of the run.
        torsion: Contact problem, kinds, bounds and slip directions; ``opening`` is set to w, which
            includes velocities if c does.
    """
    return _newton(model, torsion.slides, torsion)
