"""Forces of contacts that may stick or slip, by a semi-smooth Newton method.

    w = G F + c,   F in its cone,   w_n = 0,   F_t = -mu F_n w_t / |w_t| where w_t != 0,

where w are the accelerations of slip and separation. In the pyramid each tangent has its own bound.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.newton import make_newton
from slipgrasp.core.kernel.spatial.plant import object_bias
from slipgrasp.core.kernel.spatial.state import STATE
from slipgrasp.core.kernel.spatial.torsion_contacts import (
    contact_mobility,
    spatial_soft_newton,
)
from slipgrasp.core.kernel.spatial.torsion_layout import FREE, MOVING, NORMAL, ROWS, TURN
from slipgrasp.core.kernel.spatial.ways import axes_of
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, MAX_FORCES, WORKSPACE

# Random starts of Newton's method: for unique bounds, and for each of several choices of bounds.
MANY_STARTS, FEW_STARTS = 64, 8

# Intermediate values of a selection.
SELECTION_ROOM = np.dtype(
    [
        ("free", np.int64, (MAX_FINGERS, 2)),  # per slip mode: 1 if the slip velocity is zero
        ("leaving", np.int64, (MAX_FINGERS, 2)),  # 1 if a force on its cone is about to leave it
        ("stopped", np.int64, (MAX_FINGERS,)),  # 1 if a slip has just ended
        ("bounds", np.float64, (MAX_FINGERS, 2)),  # friction coefficients of free modes
        ("concerned", np.int64),  # contact without a consistent phase, -1 if none
        ("restarts", np.int64),  # of Newton's method
        ("start", np.int64),  # start from which Newton's method converged
        ("margins", np.float64, (MAX_FINGERS, 2)),
        ("derivative", STATE),
        ("probe", STATE),
        ("moments", np.float64, (MAX_FINGERS,)),  # F_tau / e of soft fingertips [N]
        ("spins", np.float64, (MAX_FINGERS,)),  # e psi'' of soft fingertips [m/s^2]
        ("mobility", np.float64, (MAX_FORCES, MAX_FORCES)),  # G
        ("offset", np.float64, (MAX_FORCES,)),  # c
        ("force", np.float64, (MAX_FORCES,)),
        ("opening", np.float64, (MAX_FORCES,)),  # w
        ("matrix", np.float64, (MAX_FORCES, MAX_FORCES)),
        ("right", np.float64, (MAX_FORCES,)),
        ("step", np.float64, (MAX_FORCES,)),
        ("order", np.int64, (MAX_FORCES,)),
        ("body", np.float64, (6, 6)),  # M_o, factored
        ("column", np.float64, (6,)),
        ("solution", np.float64, (6,)),
        ("responses", np.float64, (MAX_FORCES, 6)),  # columns of M_o^-1 W
        ("wrenches", np.float64, (MAX_FORCES, 6)),  # columns of W
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, STATE, WORKSPACE, SELECTION_ROOM)
def spatial_contacts(model: Record, state: Record, work: Record, room: Record) -> None:
    """Computes G and c of the contact problem, which do not depend on phases."""
    n, kin, body = model.num_fingers, work.kin, room.body
    entries = work.system.body
    for a in range(6):
        for b in range(6):
            body[a, b] = 0.0
    for a in range(3):
        body[a, a] = model.truth.object_mass
    body[3, 3], body[3, 4], body[3, 5] = entries[0], entries[1], entries[2]
    body[4, 3], body[4, 4], body[4, 5] = entries[1], entries[3], entries[4]
    body[5, 3], body[5, 4], body[5, 5] = entries[2], entries[4], entries[5]
    factor_dense(body, 6, room.order)
    object_bias(state, work.system, model.truth, model.hand.gravity, room.column)
    for k in range(6):
        room.column[k] = model.load[k] - room.column[k]
    solve_dense(body, 6, room.order, room.column, room.right)
    for i in range(n):
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        for k in range(3):
            sign = 1.0 if k == 2 else -1.0
            column = room.wrenches[3 * i + k]
            x = sign * kin.frames[i, k, 0]
            y = sign * kin.frames[i, k, 1]
            z = sign * kin.frames[i, k, 2]
            column[0], column[1], column[2] = x, y, z
            column[3], column[4], column[5] = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
            solve_dense(body, 6, room.order, column, room.responses[3 * i + k])
    for a in range(3 * n):
        for b in range(3 * n):
            total = 0.0
            for k in range(6):
                total += room.wrenches[a, k] * room.responses[b, k]
            room.mobility[a, b] = total
        total = 0.0
        for k in range(6):
            total += room.wrenches[a, k] * room.right[k]
        room.offset[a] = total
    for i in range(n):
        _add_finger(work, room, i)


@compiled
def _add_finger(work: Record, room: Record, i: int) -> None:
    """Adds the mobility of finger ``i``, the inverse of Lambda, to G and c."""
    kin, inertia = work.kin, work.dynamics.inertia[i]
    m = inverse_of(inertia)
    ux = work.tip_forces[i, 0] - work.dynamics.bias[i, 0]
    uy = work.tip_forces[i, 1] - work.dynamics.bias[i, 1]
    uz = work.tip_forces[i, 2] - work.dynamics.bias[i, 2]
    ax, ay, az = times(m, ux, uy, uz)
    ax, ay, az = ax - kin.bias[i, 0], ay - kin.bias[i, 1], az - kin.bias[i, 2]
    for a in range(3):
        row = room.wrenches[3 * i + a]
        x, y, z = row[0], row[1], row[2]
        room.offset[3 * i + a] -= x * ax + y * ay + z * az
        px, py, pz = times(m, x, y, z)
        for b in range(3):
            other = room.wrenches[3 * i + b]
            room.mobility[3 * i + a, 3 * i + b] += px * other[0] + py * other[1] + pz * other[2]


@compiled
def inverse_of(m: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Inverse of a symmetric 3x3 matrix given by six entries."""
    xx, xy, xz, yy, yz, zz = m[0], m[1], m[2], m[3], m[4], m[5]
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    scale = 1.0 / (xx * a + xy * b + xz * c)
    return (
        scale * a,
        scale * b,
        scale * c,
        scale * (xx * zz - xz * xz),
        scale * (xy * xz - xx * yz),
        scale * (xx * yy - xy * xy),
    )


@compiled
def solve_positive(m: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Product of the inverse of a positive definite 3x3 matrix and a vector, by L D L^T.

    Unlike with `inverse_of`, the residual is a rounding error even if the matrix and the vector are
    very large in one direction.
    """
    yx, zx = m[1] / m[0], m[2] / m[0]
    second, coupling = m[3] - yx * m[1], m[4] - yx * m[2]
    zy = coupling / second
    third = m[5] - zx * m[2] - zy * coupling
    y -= yx * x
    z = (z - zx * x - zy * y) / third
    y = y / second - zy * z
    return x / m[0] - yx * y - zx * z, y, z


@compiled
def times(
    m: tuple[float, float, float, float, float, float], x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Product of a symmetric 3x3 matrix, given by six entries, and a vector."""
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[1] * x + m[3] * y + m[4] * z,
        m[2] * x + m[4] * y + m[5] * z,
    )


@compiled
def _set_rows(model: Record, directions: Floats, room: Record, i: int) -> None:
    """Sets the rows of Newton's matrix for contact ``i``, and the negative residuals [N]."""
    mobility, first = room.mobility, 3 * i
    scale = 1.0 / max(mobility[first, first], mobility[first + 1, first + 1])
    _set_row_at_rest(model, room, first + 2, scale)
    for way in range(model.ways):
        if room.free[i, way] == 0:
            for axis in axes_of(model, way):
                _set_row_of_slip(model, directions, room, i, axis)
        elif model.ways == 2:
            _set_row_of_pyramid(model, room, i, way)
        else:
            _set_rows_of_cone(model, room, i, scale)


@compiled
def _set_row_at_rest(model: Record, room: Record, row: int, scale: float) -> None:
    """Sets the equation w = 0."""
    for b in range(3 * model.num_fingers):
        room.matrix[row, b] = scale * room.mobility[row, b]
    room.right[row] = -scale * room.opening[row]


@compiled
def _set_row_of_slip(model: Record, directions: Floats, room: Record, i: int, axis: int) -> None:
    """Sets the equation of a slip in progress: F_t = -mu F_n g."""
    first, g, mu = 3 * i, directions[i, axis], model.truth.friction[i]
    row, force = first + axis, room.force
    for b in range(3 * model.num_fingers):
        room.matrix[row, b] = 0.0
    room.matrix[row, row] = 1.0
    room.matrix[row, first + 2] = mu * g
    room.right[row] = -(force[row] + mu * force[first + 2] * g)


@compiled
def _set_row_of_pyramid(model: Record, room: Record, i: int, axis: int) -> None:
    """Sets the equation of a free tangent: F_k = proj(F_k - rho w_k) on |F_k| <= mu F_n."""
    first, mu, force = 3 * i, room.bounds[i, axis], room.force
    row, normal = first + axis, force[first + 2]
    scale, radius = 1.0 / room.mobility[row, row], mu * max(normal, 0.0)
    pull = force[row] - scale * room.opening[row]
    if abs(pull) <= radius:
        _set_row_at_rest(model, room, row, scale)
        return
    sign = 1.0 if pull > 0.0 else -1.0
    for b in range(3 * model.num_fingers):
        room.matrix[row, b] = 0.0
    room.matrix[row, row] = 1.0
    if normal > 0.0:
        room.matrix[row, first + 2] = -mu * sign
    room.right[row] = -(force[row] - radius * sign)


@compiled
def _set_rows_of_cone(model: Record, room: Record, i: int, scale: float) -> None:
    """Sets the equations of a free contact: F_t = proj(F_t - rho w_t) on |F_t| <= mu F_n."""
    matrix, right, mobility, force = room.matrix, room.right, room.mobility, room.force
    first, mu, opening = 3 * i, room.bounds[i, 0], room.opening
    normal = force[first + 2]
    y0 = force[first] - scale * opening[first]
    y1 = force[first + 1] - scale * opening[first + 1]
    length, radius = np.sqrt(y0 * y0 + y1 * y1), mu * max(normal, 0.0)
    if length <= radius:
        for k in range(2):
            _set_row_at_rest(model, room, first + k, scale)
        return
    e0, e1 = y0 / length, y1 / length
    ratio = radius / length
    p00, p01, p11 = ratio * (1.0 - e0 * e0), -ratio * e0 * e1, ratio * (1.0 - e1 * e1)
    for b in range(3 * model.num_fingers):
        m0, m1 = scale * mobility[first, b], scale * mobility[first + 1, b]
        matrix[first, b] = p00 * m0 + p01 * m1
        matrix[first + 1, b] = p01 * m0 + p11 * m1
    matrix[first, first] += 1.0 - p00
    matrix[first, first + 1] -= p01
    matrix[first + 1, first] -= p01
    matrix[first + 1, first + 1] += 1.0 - p11
    if normal > 0.0:
        matrix[first, first + 2] -= mu * e0
        matrix[first + 1, first + 2] -= mu * e1
    right[first] = -(force[first] - radius * e0)
    right[first + 1] = -(force[first + 1] - radius * e1)


@compiled
def _mobility(room: Record, a: int, b: int) -> float:
    """Entry of G."""
    return room.mobility[a, b]


_newton = make_newton(3, _mobility, _set_rows)


@compiled_apart(types.int64, MODEL, DISCRETE, SELECTION_ROOM)
def spatial_newton(model: Record, discrete: Record, room: Record) -> int:
    """Runs Newton's method from the forces in ``room``; 1 if it has converged."""
    return _newton(model, discrete.directions, room)


@compiled
def solve_contacts(
    model: Record, discrete: Record, work: Record, room: Record, first: int, starts: int
) -> int:
    """Runs Newton's method from the forces of stick, then from random ones; 1 if it converges.

    Args:
        model: Constants of the run.
        discrete: Directions of the slips in progress.
        work: Forces of stick, used for start 0.
        room: ``start`` is set to the start from which the method has converged.
        first: First start to try.
        starts: Last start to try.
    """
    if model.soft == 1:
        return _solve_soft_contacts(model, discrete, work, room, first, starts)
    seed = 12345
    for start in range(starts + 1):
        seed = _begin_newton(model, work, room, start, seed)
        if start < first:
            continue
        if start > first:
            room.restarts += 1
        if spatial_newton(model, discrete, room) == 1:
            room.start = start
            return 1
    return 0


@compiled
def _begin_newton(model: Record, work: Record, room: Record, start: int, seed: int) -> int:
    """Sets the forces of stick (start 0) or random forces; returns the seed of the next start."""
    for i in range(model.num_fingers):
        for k in range(3):
            if start == 0:
                room.force[3 * i + k] = work.forces[i, k]
                continue
            # Linear congruential generator from Numerical Recipes: the same on every machine.
            seed = (1664525 * seed + 1013904223) % 4294967296
            share = seed / 4294967296.0
            size = 1.0 + abs(float(work.forces[i, 2]))
            room.force[3 * i + k] = size * (2.0 * share if k == 2 else share - 0.5)
    return seed


@compiled
def _solve_soft_contacts(
    model: Record, discrete: Record, work: Record, room: Record, first: int, starts: int
) -> int:
    """As `solve_contacts`, for soft fingertips; the solution is stored in the same fields."""
    n, torsion, seed = model.num_fingers, work.torsion, 12345
    for i in range(n):
        is_free = room.free[i, 0] == 1
        torsion.kinds[i] = FREE if is_free or discrete.frozen[i, 0] == 1 else MOVING
        torsion.bounds[i] = room.bounds[i, 0] if is_free else model.truth.friction[i]
        for part in range(NORMAL):
            torsion.slides[i, part] = discrete.directions[i, part]
    for start in range(starts + 1):
        seed = _begin_newton(model, work, room, start, seed)
        if start < first:
            continue
        if start > first:
            room.restarts += 1
        for i in range(n):
            for axis in range(2):
                torsion.force[ROWS * i + axis] = room.force[3 * i + axis]
            torsion.force[ROWS * i + TURN] = work.moments[i] if start == 0 else 0.0
            torsion.force[ROWS * i + NORMAL] = room.force[3 * i + 2]
        if spatial_soft_newton(model, torsion) == 1:
            room.start = start
            for i in range(n):
                _take_soft_solution(torsion, room, i)
            return 1
    return 0


@compiled
def _take_soft_solution(torsion: Record, room: Record, i: int) -> None:
    first, row = 3 * i, ROWS * i
    for axis in range(2):
        room.force[first + axis] = torsion.force[row + axis]
        room.opening[first + axis] = torsion.opening[row + axis]
        room.mobility[first + axis, first + axis] = contact_mobility(torsion, i)
    room.force[first + 2] = torsion.force[row + NORMAL]
    room.moments[i], room.spins[i] = torsion.force[row + TURN], torsion.opening[row + TURN]
