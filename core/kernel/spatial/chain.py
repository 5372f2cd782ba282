"""A finger that is a chain of three joints, each of which turns or slides (docs/space.md, Chains).

Link k follows joint k: its frame has a fixed place and attitude in that of the link before, and
turns about, or slides along, an axis of its own. Vectors are in world axes, from the base.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.elementary import sincos, square
from slipgrasp.core.kernel.numerics.linear import cross

MAX_LINKS = 3
BY_LINKS, ON_SLIDES, BY_CHAIN = range(3)  # what carries a fingertip
LEAST_SINE = 1e-3  # |det J| over the product of its columns, below which a chain is singular
LONGEST_STEP = 0.3  # of Newton's method [rad]; share of the chain's length or of the way to its tip
CONVERGED, STALLED, MOST_STEPS = 1e-14, 1e-12, 60

# Of one finger, constant.
CHAIN = np.dtype(
    [
        ("base", np.float64, (3, 3)),  # world from base
        ("places", np.float64, (3, 3)),  # of the joints, each in the frame of the link before [m]
        ("turns", np.float64, (3, 3, 3)),  # likewise
        ("axes", np.float64, (3, 3)),  # of the joints, in their frames
        ("slides", np.int64, (3,)),  # 1 where a joint slides
        ("centres", np.float64, (3, 3)),  # of mass, in the frames of the links [m]
        ("inertias", np.float64, (3, 6)),  # about these per mass: xx, xy, xz, yy, yz, zz [m^2]
        ("tip", np.float64, (3,)),  # in the frame of the last link [m]
        ("length", np.float64),  # [m]
    ],
    align=True,
)

# Of one finger in one state.
CHAIN_STATE = np.dtype(
    [
        ("turn", np.float64, (3, 3)),
        ("turns", np.float64, (3, 3, 3)),  # world from link
        ("origins", np.float64, (3, 3)),  # of the links [m]
        ("axes", np.float64, (3, 3)),
        ("tip", np.float64, (3,)),  # [m]
        ("jacobian", np.float64, (3, 3)),
        ("inverse", np.float64, (3, 3)),  # J^-1
        ("target", np.float64, (3,)),  # of the tip [m]
        ("step", np.float64, (3,)),
        ("inertias", np.float64, (3, 6)),  # M of a link with a mass of 1 kg
        ("biases", np.float64, (3, 3)),  # its h
        ("weights", np.float64, (3, 3)),  # the part of h that carries it at rest
        ("heights", np.float64, (3,)),  # of its centre of mass [m]
        ("column", np.float64, (3, 3)),  # what a link is computed with
        ("rotation", np.float64, (3, 3)),
        ("inertia", np.float64, (6,)),
        ("bias", np.float64, (3,)),
        ("moment", np.float64, (3, 3)),
    ],
    align=True,
)


@compiled
def _apply(matrix: Floats, vector: Floats) -> tuple[float, float, float]:
    """A matrix times a vector."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
    )


@compiled
def _symmetric(matrix: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A symmetric matrix (xx, xy, xz, yy, yz, zz) times a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[1] * x + matrix[3] * y + matrix[4] * z,
        matrix[2] * x + matrix[4] * y + matrix[5] * z,
    )


@compiled
def solve_chain(
    chain: Record, target: Floats, seed: Floats, positions: Floats, now: Record
) -> float:
    """Joint positions that put the tip at ``target``, from a seed; ``now`` is placed there.

    Returns:
        |det J| over the product of its columns less its least allowed value; -1 where Newton's
        method has not converged.
    """
    for k in range(3):
        positions[k] = seed[k]
    before, length = np.inf, max(chain.length, np.sqrt(_squared(target)))
    for _ in range(MOST_STEPS):
        margin = place_chain(chain, positions, now)
        if not margin > 0.0:
            return margin
        size = _step(chain, target, length, positions, now)
        if size < CONVERGED or (size < STALLED and size >= before):
            return place_chain(chain, positions, now)
        before = size
    return -1.0


@compiled
def _squared(vector: Floats) -> float:
    return square(vector[0]) + square(vector[1]) + square(vector[2])


@compiled
def _step(chain: Record, target: Floats, length: float, positions: Floats, now: Record) -> float:
    """One step of Newton's method; its largest part, of slides over a length."""
    largest = 0.0
    for k in range(3):
        total = 0.0
        for c in range(3):
            total += now.inverse[k, c] * (target[c] - now.tip[c])
        now.step[k] = total
        largest = max(largest, abs(total) / length if chain.slides[k] == 1 else abs(total))
    scale = LONGEST_STEP / largest if largest > LONGEST_STEP else 1.0
    for k in range(3):
        positions[k] += scale * now.step[k]
    return largest


@compiled
def place_chain(chain: Record, positions: Floats, now: Record) -> float:
    """Links, tip, Jacobian and its inverse at joint positions.

    Returns:
        |det J| over the product of its columns less its least allowed value.
    """
    turn, px, py, pz = now.turn, 0.0, 0.0, 0.0
    for a in range(3):
        for b in range(3):
            turn[a, b] = chain.base[a, b]
    for k in range(3):
        dx, dy, dz = _apply(turn, chain.places[k])
        px, py, pz = px + dx, py + dy, pz + dz
        _multiply(turn, chain.turns[k], now.turns[k])
        zx, zy, zz = _apply(now.turns[k], chain.axes[k])
        now.axes[k, 0], now.axes[k, 1], now.axes[k, 2] = zx, zy, zz
        if chain.slides[k] == 1:
            q = positions[k]
            px, py, pz = px + zx * q, py + zy * q, pz + zz * q
        else:
            _rotate(chain.axes[k], positions[k], now.rotation)
            _multiply(now.turns[k], now.rotation, turn)
            for a in range(3):
                for b in range(3):
                    now.turns[k, a, b] = turn[a, b]
        for a in range(3):
            for b in range(3):
                turn[a, b] = now.turns[k, a, b]
        now.origins[k, 0], now.origins[k, 1], now.origins[k, 2] = px, py, pz
    tx, ty, tz = _apply(turn, chain.tip)
    now.tip[0], now.tip[1], now.tip[2] = px + tx, py + ty, pz + tz
    for k in range(3):
        x, y, z = _column(chain, now, k, now.tip[0], now.tip[1], now.tip[2])
        now.jacobian[0, k], now.jacobian[1, k], now.jacobian[2, k] = x, y, z
    return _invert(now.jacobian, now.inverse) - LEAST_SINE


@compiled
def _column(
    chain: Record, now: Record, k: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """How a point moves with joint ``k``."""
    zx, zy, zz = now.axes[k, 0], now.axes[k, 1], now.axes[k, 2]
    if chain.slides[k] == 1:
        return zx, zy, zz
    return cross(zx, zy, zz, x - now.origins[k, 0], y - now.origins[k, 1], z - now.origins[k, 2])


@compiled
def chain_turning(
    chain: Record, now: Record, rates: Floats
) -> tuple[float, float, float, float, float, float]:
    """Angular velocity of the last link [rad/s], and J_omega' q' [rad/s^2]."""
    wx = wy = wz = bx = by = bz = 0.0
    for k in range(3):
        if chain.slides[k] == 1:
            continue
        x, y, z = rates[k] * now.axes[k, 0], rates[k] * now.axes[k, 1], rates[k] * now.axes[k, 2]
        # The axis turns with the links before it.
        tx, ty, tz = cross(wx, wy, wz, x, y, z)
        bx, by, bz = bx + tx, by + ty, bz + tz
        wx, wy, wz = wx + x, wy + y, wz + z
    return wx, wy, wz, bx, by, bz


@compiled
def moment_at_chain(
    chain: Record, now: Record, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """J^-T J_omega^T times a moment on the last link."""
    fx = fy = fz = 0.0
    for k in range(3):
        if chain.slides[k] == 1:
            continue
        torque = now.axes[k, 0] * x + now.axes[k, 1] * y + now.axes[k, 2] * z
        fx += now.inverse[k, 0] * torque
        fy += now.inverse[k, 1] * torque
        fz += now.inverse[k, 2] * torque
    return fx, fy, fz


@compiled
def _rotate(axis: Floats, angle: float, rotation: Floats) -> None:
    """The rotation about a unit vector by an angle [rad]."""
    sine, cosine = sincos(angle)
    x, y, z, rest = axis[0], axis[1], axis[2], 1.0 - cosine
    rotation[0, 0] = cosine + rest * x * x
    rotation[0, 1] = rest * x * y - sine * z
    rotation[0, 2] = rest * x * z + sine * y
    rotation[1, 0] = rest * x * y + sine * z
    rotation[1, 1] = cosine + rest * y * y
    rotation[1, 2] = rest * y * z - sine * x
    rotation[2, 0] = rest * x * z - sine * y
    rotation[2, 1] = rest * y * z + sine * x
    rotation[2, 2] = cosine + rest * z * z


@compiled
def _multiply(a: Floats, b: Floats, product: Floats) -> None:
    for i in range(3):
        for j in range(3):
            product[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled
def _invert(matrix: Floats, inverse: Floats) -> float:
    """Inverse of a 3x3 matrix by its columns; |det| over the product of the columns."""
    product = 1.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        x, y, z = cross(
            matrix[0, a], matrix[1, a], matrix[2, a], matrix[0, b], matrix[1, b], matrix[2, b]
        )
        inverse[k, 0], inverse[k, 1], inverse[k, 2] = x, y, z
        product *= np.sqrt(square(matrix[0, k]) + square(matrix[1, k]) + square(matrix[2, k]))
    determinant = 0.0
    for c in range(3):
        determinant += inverse[0, c] * matrix[c, 0]
    if not abs(determinant) > 0.0:
        return 0.0
    for k in range(3):
        for c in range(3):
            inverse[k, c] /= determinant
    return abs(determinant) / product


@compiled
def move_chain(
    chain: Record, gravity: float, rates: Floats, now: Record, curvature: Floats
) -> None:
    """M, h and height of every link per mass, and J' q' of the tip, for a placed chain.

    Outwards from the base: angular velocity, its rate and the acceleration of the origin of each
    link while the joints do not accelerate.
    """
    wx = wy = wz = ax = ay = az = 0.0  # angular velocity and acceleration
    ox = oy = oz = vx = vy = vz = 0.0  # origin before, and its acceleration
    for k in range(3):
        zx, zy, zz = now.axes[k, 0], now.axes[k, 1], now.axes[k, 2]
        rate, x, y, z = rates[k], now.origins[k, 0], now.origins[k, 1], now.origins[k, 2]
        # What a slide goes is carried by the link before.
        cx, cy, cz = _carried(wx, wy, wz, ax, ay, az, x - ox, y - oy, z - oz)
        vx, vy, vz = vx + cx, vy + cy, vz + cz
        px, py, pz = cross(wx, wy, wz, rate * zx, rate * zy, rate * zz)
        if chain.slides[k] == 1:
            vx, vy, vz = vx + 2.0 * px, vy + 2.0 * py, vz + 2.0 * pz
        else:
            ax, ay, az = ax + px, ay + py, az + pz
            wx, wy, wz = wx + rate * zx, wy + rate * zy, wz + rate * zz
        ox, oy, oz = x, y, z
        cx, cy, cz = _apply(now.turns[k], chain.centres[k])
        bx, by, bz = _carried(wx, wy, wz, ax, ay, az, cx, cy, cz)
        _world_inertia(now.turns[k], chain.inertias[k], now.inertia)
        lx, ly, lz = _symmetric(now.inertia, wx, wy, wz)
        mx, my, mz = _symmetric(now.inertia, ax, ay, az)
        gx, gy, gz = cross(wx, wy, wz, lx, ly, lz)
        _set_link(
            chain,
            gravity,
            now,
            k,
            (ox + cx, oy + cy, oz + cz),
            (vx + bx, vy + by, vz + bz),
            (mx + gx, my + gy, mz + gz),
        )
    tx, ty, tz = now.tip[0] - ox, now.tip[1] - oy, now.tip[2] - oz
    cx, cy, cz = _carried(wx, wy, wz, ax, ay, az, tx, ty, tz)
    curvature[0], curvature[1], curvature[2] = vx + cx, vy + cy, vz + cz


@compiled
def _carried(
    wx: float,
    wy: float,
    wz: float,
    ax: float,
    ay: float,
    az: float,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float]:
    """Acceleration of a point relative to another of one body: w' x r + w x (w x r)."""
    px, py, pz = cross(wx, wy, wz, x, y, z)
    qx, qy, qz = cross(wx, wy, wz, px, py, pz)
    rx, ry, rz = cross(ax, ay, az, x, y, z)
    return rx + qx, ry + qy, rz + qz


@compiled
def _world_inertia(turn: Floats, inertia: Floats, entries: Floats) -> None:
    """R I R^T, six entries."""
    at = 0
    for a in range(3):
        x, y, z = _symmetric(inertia, turn[a, 0], turn[a, 1], turn[a, 2])
        for b in range(a, 3):
            entries[at] = x * turn[b, 0] + y * turn[b, 1] + z * turn[b, 2]
            at += 1


@compiled
def _set_link(
    chain: Record,
    gravity: float,
    now: Record,
    k: int,
    centre: tuple[float, float, float],
    acceleration: tuple[float, float, float],
    moment: tuple[float, float, float],
) -> None:
    """M = J_c^T J_c + J_w^T I J_w and h = J_c^T (a_c + g z) + J_w^T (I w' + w x I w) of a link."""
    columns, moments = now.column, now.moment
    for j in range(3):
        x = y = z = tx = ty = tz = 0.0
        if j <= k:
            x, y, z = _column(chain, now, j, centre[0], centre[1], centre[2])
            if chain.slides[j] == 0:
                tx, ty, tz = now.axes[j, 0], now.axes[j, 1], now.axes[j, 2]
        columns[j, 0], columns[j, 1], columns[j, 2] = x, y, z
        now.weights[k, j] = gravity * z
        motion = x * acceleration[0] + y * acceleration[1] + z * acceleration[2]
        turning = tx * moment[0] + ty * moment[1] + tz * moment[2]
        now.biases[k, j] = now.weights[k, j] + motion + turning
        moments[j, 0], moments[j, 1], moments[j, 2] = _symmetric(now.inertia, tx, ty, tz)
    at = 0
    for a in range(3):
        turns = a <= k and chain.slides[a] == 0
        for b in range(a, 3):
            total = 0.0
            for c in range(3):
                total += columns[a, c] * columns[b, c]
                if turns:
                    total += now.axes[a, c] * moments[b, c]
            now.inertias[k, at] = total
            at += 1
    now.heights[k] = centre[2]


@compiled
def add_links(masses: Floats, now: Record) -> None:
    """M and h of the whole finger, in ``inertia`` and ``bias``."""
    for k in range(6):
        now.inertia[k] = 0.0
        for link in range(MAX_LINKS):
            now.inertia[k] += masses[link] * now.inertias[link, k]
    for k in range(3):
        now.bias[k] = 0.0
        for link in range(MAX_LINKS):
            now.bias[k] += masses[link] * now.biases[link, k]


@compiled
def see_at_tip(
    inverse: Floats,
    inertia: Floats,
    bias: Floats,
    curvature: Floats,
    tip_inertia: Floats,
    tip_bias: Floats,
) -> None:
    """Lambda = J^-T M J^-1 and f_0 = J^-T h - Lambda J' q' of a finger from its M and h."""
    at = 0
    for a in range(3):
        x, y, z = _symmetric(inertia, inverse[0, a], inverse[1, a], inverse[2, a])
        for b in range(a, 3):
            tip_inertia[at] = x * inverse[0, b] + y * inverse[1, b] + z * inverse[2, b]
            at += 1
    lx, ly, lz = _symmetric(tip_inertia, curvature[0], curvature[1], curvature[2])
    lost = (lx, ly, lz)
    for a in range(3):
        force = inverse[0, a] * bias[0] + inverse[1, a] * bias[1] + inverse[2, a] * bias[2]
        tip_bias[a] = force - lost[a]


@compiled
def chain_weight(now: Record, masses: Floats) -> tuple[float, float, float]:
    """What the joints must give, as a tip force, to carry the links."""
    force = now.bias
    for c in range(3):
        force[c] = 0.0
    for link in range(MAX_LINKS):
        for k in range(3):
            torque = masses[link] * now.weights[link, k]
            for c in range(3):
                force[c] += now.inverse[k, c] * torque
    return force[0], force[1], force[2]
