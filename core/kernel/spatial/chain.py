"""Fingers that are chains of revolute and prismatic joints (docs/space.md, Chains).

Joint k moves link k: the frame of the link has a fixed position and attitude in the frame of the
previous link, and rotates about, or translates along, its z axis. Joints may be coupled: the
positions of all joints are q = A c + b with three coordinates c. Vectors are in world axes, from
the base of the finger. Motions of links are twists about the base: the angular velocity w, and the
velocity v of the point of the link that coincides with the base.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.elementary import sincos, square
from slipgrasp.core.kernel.numerics.linear import cross
from slipgrasp.core.scenario.chain import MAX_LINKS

LEAST_SINE = 1e-3  # |det J| over the product of column lengths below which a chain is singular
LONGEST_STEP = 0.3  # of Newton's method [rad]; of slides, relative to the length of the chain
SURE_STEP, ROUNDING, MOST_STEPS, MOST_HALVINGS = 1e-9, 1e-15, 60, 10

# Constants of one finger.
CHAIN = np.dtype(
    [
        ("links", np.int64),  # number of joints, and of links
        ("couples", np.int64),  # 1 if any joint is coupled to another one
        ("ratios", np.float64, (MAX_LINKS, 3)),  # A
        ("offsets", np.float64, (MAX_LINKS,)),  # b [rad, m]
        ("places", np.float64, (MAX_LINKS, 3)),  # of the joints in the previous link or base [m]
        ("turns", np.float64, (MAX_LINKS, 3, 3)),  # attitudes likewise; the first in world axes
        ("slides", np.int64, (MAX_LINKS,)),  # 1 if the joint is prismatic
        ("centres", np.float64, (MAX_LINKS, 3)),  # centres of mass in the link frames [m]
        ("inertias", np.float64, (MAX_LINKS, 6)),  # about the centres, per mass: xx, xy, ... [m^2]
        ("tip", np.float64, (3,)),  # in the frame of the last link [m]
        ("length", np.float64),  # [m]
        ("limits", np.float64, (MAX_LINKS, 2)),  # joint limits: minimum, maximum
    ],
    align=True,
)

# Initial guess of the inverse kinematics: the coordinates at a tick.
SEED = np.dtype(
    [
        ("positions", np.float64, (3,)),  # [rad, m]
        ("tip", np.float64, (3,)),  # its tip position [m]
        ("inverse", np.float64, (3, 3)),  # J^-1; 0 if tip and J^-1 are not yet known
    ],
    align=True,
)

# Kinematics and dynamics of one finger in one state.
CHAIN_STATE = np.dtype(
    [
        ("joints", np.float64, (MAX_LINKS,)),  # joint positions [rad, m]
        ("sines", np.float64, (MAX_LINKS,)),  # of the joint angles
        ("cosines", np.float64, (MAX_LINKS,)),
        ("turns", np.float64, (MAX_LINKS, 3, 3)),  # world from link
        ("origins", np.float64, (MAX_LINKS, 3)),  # of the links [m]
        ("axes", np.float64, (MAX_LINKS, 3)),  # w per joint rate
        ("moves", np.float64, (MAX_LINKS, 3)),  # v per joint rate
        ("spins", np.float64, (MAX_LINKS, 6)),  # w, and w' at zero joint accelerations
        ("drifts", np.float64, (MAX_LINKS, 6)),  # v, and v' likewise
        ("tip", np.float64, (3,)),  # [m]
        ("columns", np.float64, (MAX_LINKS, 3)),  # tip velocity per joint rate
        ("jacobian", np.float64, (3, 3)),
        ("inverse", np.float64, (3, 3)),  # J^-1
        ("target", np.float64, (3,)),  # of the tip [m]
        ("step", np.float64, (3,)),
        ("masses", np.float64, (MAX_LINKS,)),  # link masses: 1 kg for one link, 0 for others [kg]
        ("body", np.float64, (6,)),  # inertia of a link
        ("matrix", np.float64, (MAX_LINKS, MAX_LINKS)),  # M of all joints
        ("torques", np.float64, (MAX_LINKS,)),  # h of all joints
        ("inertia", np.float64, (6,)),  # M of the coordinates
        ("bias", np.float64, (3,)),  # h of the coordinates
    ],
    align=True,
)


@compiled
def _apply(matrix: Floats, vector: Floats) -> tuple[float, float, float]:
    """Product of a matrix and a vector."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
    )


@compiled
def _symmetric(matrix: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Product of a symmetric matrix (xx, xy, xz, yy, yz, zz) and a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[1] * x + matrix[3] * y + matrix[4] * z,
        matrix[2] * x + matrix[4] * y + matrix[5] * z,
    )


@compiled
def _of_joint(chain: Record, values: Floats, k: int) -> float:
    """Value of joint ``k`` from the values of the coordinates, by A."""
    if chain.couples == 0:
        return values[k]
    total = 0.0
    for c in range(3):
        total += chain.ratios[k, c] * values[c]
    return total


@compiled
def _to_coordinates(chain: Record, values: Floats, reduced: Floats) -> None:
    """Writes A^T times the joint values to ``reduced``."""
    for c in range(3):
        reduced[c] = values[c]
        if chain.couples == 1:
            reduced[c] = 0.0
            for k in range(chain.links):
                reduced[c] += chain.ratios[k, c] * values[k]


@compiled
def solve_chain(
    chain: Record, target: Floats, seed: Record, positions: Floats, now: Record
) -> float:
    """Computes the coordinates for a tip at ``target``, from a seed, and updates ``now``.

    Newton's method converges quadratically: two consecutive steps give the remaining error.

    Returns:
        |det J| over the product of column lengths, minus its minimum; -1 if Newton's method has
        not converged.
    """
    for k in range(3):
        positions[k] = seed.positions[k]
    length = max(chain.length, np.sqrt(_squared(target)))
    before = _step(chain, target, length, seed.inverse, seed.tip, positions, now)
    halvings = 0
    for _ in range(MOST_STEPS):
        margin = place_chain(chain, positions, now, False)
        if not margin > 0.0:
            if halvings == MOST_HALVINGS:
                return margin
            # The step may pass a singularity that the solution does not have.
            halvings, before = halvings + 1, 0.0
            for k in range(3):
                now.step[k] *= 0.5
                positions[k] -= now.step[k]
            continue
        size = _step(chain, target, length, now.inverse, now.tip, positions, now)
        left = square(size)
        if size < SURE_STEP or (left < ROUNDING and size * left < ROUNDING * square(before)):
            return place_chain(chain, positions, now, True)
        before = size
    return -1.0


@compiled
def renew_seed(positions: Floats, now: Record, seed: Record) -> None:
    """Sets the seed to the current coordinates of a chain."""
    for k in range(3):
        seed.positions[k], seed.tip[k] = positions[k], now.tip[k]
        for c in range(3):
            seed.inverse[k, c] = now.inverse[k, c]


@compiled
def copy_seed(source: Record, target: Record) -> None:
    """Copies a seed."""
    for k in range(3):
        target.positions[k], target.tip[k] = source.positions[k], source.tip[k]
        for c in range(3):
            target.inverse[k, c] = source.inverse[k, c]


@compiled
def _squared(vector: Floats) -> float:
    return square(vector[0]) + square(vector[1]) + square(vector[2])


@compiled
def _step(
    chain: Record,
    target: Floats,
    length: float,
    inverse: Floats,
    tip: Floats,
    positions: Floats,
    now: Record,
) -> float:
    """Takes a Newton step; returns its largest component, of slides relative to ``length``."""
    largest = 0.0
    for k in range(3):
        total = 0.0
        for c in range(3):
            total += inverse[k, c] * (target[c] - tip[c])
        now.step[k] = total
    for k in range(chain.links):
        size = abs(_of_joint(chain, now.step, k))
        largest = max(largest, size / length if chain.slides[k] == 1 else size)
    scale = LONGEST_STEP / largest if largest > LONGEST_STEP else 1.0
    for k in range(3):
        now.step[k] *= scale
        positions[k] += now.step[k]
    return largest


@compiled
def place_chain(chain: Record, positions: Floats, now: Record, is_near: bool) -> float:
    """Computes links, tip, Jacobian and inverse Jacobian for given coordinates.

    Args:
        chain: Constants of the chain.
        positions: Coordinates.
        now: Output.
        is_near: True if every joint differs from ``now`` by less than 4e-6 rad.

    Returns:
        |det J| over the product of column lengths, minus its minimum.
    """
    px, py, pz = chain.places[0, 0], chain.places[0, 1], chain.places[0, 2]
    for a in range(3):
        for b in range(3):
            now.turns[0, a, b] = chain.turns[0, a, b]
    for k in range(chain.links):
        if k > 0:
            dx, dy, dz = _apply(now.turns[k - 1], chain.places[k])
            px, py, pz = px + dx, py + dy, pz + dz
            _multiply(now.turns[k - 1], chain.turns[k], now.turns[k])
        turn, q = now.turns[k], _of_joint(chain, positions, k) + chain.offsets[k]
        zx, zy, zz = turn[0, 2], turn[1, 2], turn[2, 2]
        step, now.joints[k] = q - now.joints[k], q
        if chain.slides[k] == 1:
            px, py, pz = px + zx * q, py + zy * q, pz + zz * q
            now.axes[k, 0] = now.axes[k, 1] = now.axes[k, 2] = 0.0
            now.moves[k, 0], now.moves[k, 1], now.moves[k, 2] = zx, zy, zz
        else:
            if is_near:
                _add_angle(now, k, step)
            else:
                now.sines[k], now.cosines[k] = sincos(q)
            _turn(turn, now.sines[k], now.cosines[k])
            now.axes[k, 0], now.axes[k, 1], now.axes[k, 2] = zx, zy, zz
            vx, vy, vz = cross(px, py, pz, zx, zy, zz)
            now.moves[k, 0], now.moves[k, 1], now.moves[k, 2] = vx, vy, vz
        now.origins[k, 0], now.origins[k, 1], now.origins[k, 2] = px, py, pz
    tx, ty, tz = _apply(now.turns[chain.links - 1], chain.tip)
    now.tip[0], now.tip[1], now.tip[2] = px + tx, py + ty, pz + tz
    return _update_jacobian(chain, now) - LEAST_SINE


@compiled
def limit_margin(chain: Record, now: Record) -> float:
    """Smallest distance of a joint to its limits [rad, m]."""
    least = np.inf
    for k in range(chain.links):
        low, high = chain.limits[k, 0], chain.limits[k, 1]
        least = min(least, now.joints[k] - low, high - now.joints[k])
    return least


@compiled
def coordinate_range(chain: Record, c: int) -> tuple[float, float]:
    """Range of coordinate ``c`` within the limits of its joint and of those coupled to it."""
    low, high = -np.inf, np.inf
    for k in range(chain.links):
        ratio = chain.ratios[k, c]
        if ratio != 0.0:
            first = (chain.limits[k, 0] - chain.offsets[k]) / ratio
            second = (chain.limits[k, 1] - chain.offsets[k]) / ratio
            low, high = max(low, min(first, second)), min(high, max(first, second))
    return low, high


@compiled
def _add_angle(now: Record, k: int, step: float) -> None:
    """Updates sine and cosine of a joint for a step below 4e-6 rad, whose cube is negligible."""
    sine, cosine, less = now.sines[k], now.cosines[k], 0.5 * square(step)
    now.sines[k] = sine + (cosine * step - sine * less)
    now.cosines[k] = cosine - (sine * step + cosine * less)


@compiled
def _turn(turn: Floats, sine: float, cosine: float) -> None:
    """Rotates a frame about its z axis."""
    for a in range(3):
        x, y = turn[a, 0], turn[a, 1]
        turn[a, 0], turn[a, 1] = cosine * x + sine * y, cosine * y - sine * x


@compiled
def _update_jacobian(chain: Record, now: Record) -> float:
    """Computes the tip Jacobian and its inverse; returns |det J| over the column lengths."""
    x, y, z = now.tip[0], now.tip[1], now.tip[2]
    for k in range(chain.links):
        axes, moves = now.axes[k], now.moves[k]
        cx, cy, cz = cross(axes[0], axes[1], axes[2], x, y, z)
        columns = now.columns[k]
        columns[0], columns[1], columns[2] = cx + moves[0], cy + moves[1], cz + moves[2]
    for c in range(3):
        for a in range(3):
            now.jacobian[a, c] = now.columns[c, a]
            if chain.couples == 1:
                now.jacobian[a, c] = 0.0
                for k in range(chain.links):
                    now.jacobian[a, c] += chain.ratios[k, c] * now.columns[k, a]
    return _invert(now.jacobian, now.inverse)


@compiled
def chain_turning(chain: Record, now: Record) -> tuple[float, float, float, float, float, float]:
    """Angular velocity of the last link [rad/s] and J_omega' q' [rad/s^2], after `move_chain`."""
    spin = now.spins[chain.links - 1]
    return spin[0], spin[1], spin[2], spin[3], spin[4], spin[5]


@compiled
def moment_at_chain(
    chain: Record, now: Record, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Tip force J^-T J_omega^T m that is equivalent to a moment m on the last link."""
    for k in range(chain.links):
        now.torques[k] = now.axes[k, 0] * x + now.axes[k, 1] * y + now.axes[k, 2] * z
    return _tip_force(chain, now)


@compiled
def _tip_force(chain: Record, now: Record) -> tuple[float, float, float]:
    """Tip force J^-T A^T tau for the torques of all joints."""
    _to_coordinates(chain, now.torques, now.bias)
    inverse, t0, t1, t2 = now.inverse, now.bias[0], now.bias[1], now.bias[2]
    return (
        inverse[0, 0] * t0 + inverse[1, 0] * t1 + inverse[2, 0] * t2,
        inverse[0, 1] * t0 + inverse[1, 1] * t1 + inverse[2, 1] * t2,
        inverse[0, 2] * t0 + inverse[1, 2] * t1 + inverse[2, 2] * t2,
    )


@compiled
def _multiply(a: Floats, b: Floats, product: Floats) -> None:
    for i in range(3):
        for j in range(3):
            product[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@compiled
def _invert(matrix: Floats, inverse: Floats) -> float:
    """Inverts a 3x3 matrix; returns |det| over the product of column lengths."""
    product = 1.0
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        x, y, z = cross(
            matrix[0, a], matrix[1, a], matrix[2, a], matrix[0, b], matrix[1, b], matrix[2, b]
        )
        inverse[k, 0], inverse[k, 1], inverse[k, 2] = x, y, z
        product *= square(matrix[0, k]) + square(matrix[1, k]) + square(matrix[2, k])
    determinant = 0.0
    for c in range(3):
        determinant += inverse[0, c] * matrix[c, 0]
    if not abs(determinant) > 0.0:
        return 0.0
    scale = 1.0 / determinant
    for k in range(3):
        for c in range(3):
            inverse[k, c] *= scale
    return abs(determinant) / np.sqrt(product)


@compiled
def move_chain(chain: Record, rates: Floats, now: Record, curvature: Floats) -> None:
    """Computes the motion of every link, and J' q' of the tip, after `place_chain`.

    The twist of a joint moves with the previous link.
    """
    wx = wy = wz = ax = ay = az = 0.0  # w and w'
    vx = vy = vz = bx = by = bz = 0.0  # v and v'
    for k in range(chain.links):
        rate, axes, moves = _of_joint(chain, rates, k), now.axes[k], now.moves[k]
        zx, zy, zz = rate * axes[0], rate * axes[1], rate * axes[2]
        dx, dy, dz = rate * moves[0], rate * moves[1], rate * moves[2]
        px, py, pz = cross(wx, wy, wz, zx, zy, zz)
        ax, ay, az = ax + px, ay + py, az + pz
        px, py, pz = cross(wx, wy, wz, dx, dy, dz)
        qx, qy, qz = cross(vx, vy, vz, zx, zy, zz)
        bx, by, bz = bx + px + qx, by + py + qy, bz + pz + qz
        wx, wy, wz = wx + zx, wy + zy, wz + zz
        vx, vy, vz = vx + dx, vy + dy, vz + dz
        spins, drifts = now.spins[k], now.drifts[k]
        spins[0], spins[1], spins[2], spins[3], spins[4], spins[5] = wx, wy, wz, ax, ay, az
        drifts[0], drifts[1], drifts[2], drifts[3], drifts[4], drifts[5] = vx, vy, vz, bx, by, bz
    tx, ty, tz = now.tip[0], now.tip[1], now.tip[2]
    px, py, pz = cross(wx, wy, wz, tx, ty, tz)
    qx, qy, qz = cross(wx, wy, wz, vx + px, vy + py, vz + pz)
    px, py, pz = cross(ax, ay, az, tx, ty, tz)
    curvature[0], curvature[1], curvature[2] = bx + px + qx, by + py + qy, bz + pz + qz


@compiled
def weigh_chain(chain: Record, masses: Floats, gravity: float, now: Record) -> tuple[float, float]:
    """Computes M and h in ``inertia`` and ``bias``, after `move_chain`, from the tip inwards.

    The links beyond a joint are combined: mass m, first moment s and inertia I about the base. The
    force f = m v' + w' x s + w x (m v + w x s) and the moment about the base
    n = I w' + s x v' + w x (I w + s x v) + v x (m v + w x s) are summed link by link.

    Returns:
        Mass [kg], and mass times height of the centre of mass above the base [kg m].
    """
    mass = sx = sy = sz = 0.0
    xx = xy = xz = yy = yz = zz = 0.0
    fx = fy = fz = nx = ny = nz = 0.0
    for back in range(chain.links):
        k: int = chain.links - 1 - back
        own = masses[k]
        if own != 0.0:
            hx, hy, hz = _set_body(chain, own, now, k)
            force, moment = _bias_wrench(own, hx, hy, hz, now, k)
            body = now.body
            fx, fy, fz = fx + force[0], fy + force[1], fz + force[2] + gravity * own
            nx, ny = nx + moment[0] + gravity * hy, ny + moment[1] - gravity * hx
            nz, mass, sx, sy, sz = nz + moment[2], mass + own, sx + hx, sy + hy, sz + hz
            xx, xy, xz = xx + body[0], xy + body[1], xz + body[2]
            yy, yz, zz = yy + body[3], yz + body[4], zz + body[5]
        axes, moves = now.axes[k], now.moves[k]
        ax, ay, az, vx, vy, vz = axes[0], axes[1], axes[2], moves[0], moves[1], moves[2]
        now.torques[k] = ax * nx + ay * ny + az * nz + vx * fx + vy * fy + vz * fz
        # Momentum of the links beyond the joint, about the base, for the joint rate 1.
        px, py, pz = cross(ax, ay, az, sx, sy, sz)
        px, py, pz = px + mass * vx, py + mass * vy, pz + mass * vz
        lx, ly, lz = cross(sx, sy, sz, vx, vy, vz)
        lx += xx * ax + xy * ay + xz * az
        ly += xy * ax + yy * ay + yz * az
        lz += xz * ax + yz * ay + zz * az
        for j in range(k + 1):
            axes, moves = now.axes[j], now.moves[j]
            spin = axes[0] * lx + axes[1] * ly + axes[2] * lz
            now.matrix[j, k] = spin + moves[0] * px + moves[1] * py + moves[2] * pz
    _reduce(chain, now)
    return mass, sz


@compiled
def _set_body(chain: Record, mass: float, now: Record, k: int) -> tuple[float, float, float]:
    """First moment of a link about the base; writes its inertia about the base to ``body``."""
    turn, inertia, body = now.turns[k], chain.inertias[k], now.body
    cx, cy, cz = _apply(turn, chain.centres[k])
    x, y, z = cx + now.origins[k, 0], cy + now.origins[k, 1], cz + now.origins[k, 2]
    at = 0
    for a in range(3):
        ix, iy, iz = _symmetric(inertia, turn[a, 0], turn[a, 1], turn[a, 2])
        for b in range(a, 3):
            body[at] = mass * (ix * turn[b, 0] + iy * turn[b, 1] + iz * turn[b, 2])
            at += 1
    hx, hy, hz = mass * x, mass * y, mass * z
    body[0] += hy * y + hz * z
    body[1] -= hx * y
    body[2] -= hx * z
    body[3] += hx * x + hz * z
    body[4] -= hy * z
    body[5] += hx * x + hy * y
    return hx, hy, hz


@compiled
def _bias_wrench(
    mass: float, sx: float, sy: float, sz: float, now: Record, k: int
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Force on a link and moment about the base at zero joint accelerations."""
    spins, drifts, body = now.spins[k], now.drifts[k], now.body
    wx, wy, wz, ax, ay, az = spins[0], spins[1], spins[2], spins[3], spins[4], spins[5]
    vx, vy, vz, bx, by, bz = drifts[0], drifts[1], drifts[2], drifts[3], drifts[4], drifts[5]
    px, py, pz = cross(wx, wy, wz, sx, sy, sz)
    px, py, pz = px + mass * vx, py + mass * vy, pz + mass * vz  # momentum
    lx, ly, lz = _symmetric(body, wx, wy, wz)
    qx, qy, qz = cross(sx, sy, sz, vx, vy, vz)
    lx, ly, lz = lx + qx, ly + qy, lz + qz  # angular momentum
    fx, fy, fz = cross(ax, ay, az, sx, sy, sz)
    qx, qy, qz = cross(wx, wy, wz, px, py, pz)
    fx, fy, fz = fx + mass * bx + qx, fy + mass * by + qy, fz + mass * bz + qz
    nx, ny, nz = _symmetric(body, ax, ay, az)
    qx, qy, qz = cross(sx, sy, sz, bx, by, bz)
    nx, ny, nz = nx + qx, ny + qy, nz + qz
    qx, qy, qz = cross(wx, wy, wz, lx, ly, lz)
    nx, ny, nz = nx + qx, ny + qy, nz + qz
    qx, qy, qz = cross(vx, vy, vz, px, py, pz)
    return (fx, fy, fz), (nx + qx, ny + qy, nz + qz)


@compiled
def _reduce(chain: Record, now: Record) -> None:
    """Computes A^T M A and A^T h of the coordinates."""
    _to_coordinates(chain, now.torques, now.bias)
    at = 0
    for a in range(3):
        for b in range(a, 3):
            total = now.matrix[a, b]
            if chain.couples == 1:
                total = 0.0
                for j in range(chain.links):
                    for k in range(j, chain.links):
                        first = chain.ratios[j, a] * chain.ratios[k, b]
                        if k > j:
                            first += chain.ratios[k, a] * chain.ratios[j, b]
                        total += first * now.matrix[j, k]
            now.inertia[at] = total
            at += 1


@compiled
def see_at_tip(
    inverse: Floats,
    inertia: Floats,
    bias: Floats,
    curvature: Floats,
    tip_inertia: Floats,
    tip_bias: Floats,
) -> None:
    """Computes Lambda = J^-T M J^-1 and f_0 = J^-T h - Lambda J' q' of a finger."""
    at = 0
    for a in range(3):
        x, y, z = _symmetric(inertia, inverse[0, a], inverse[1, a], inverse[2, a])
        for b in range(a, 3):
            tip_inertia[at] = x * inverse[0, b] + y * inverse[1, b] + z * inverse[2, b]
            at += 1
    lost = _symmetric(tip_inertia, curvature[0], curvature[1], curvature[2])
    for a in range(3):
        force = inverse[0, a] * bias[0] + inverse[1, a] * bias[1] + inverse[2, a] * bias[2]
        tip_bias[a] = force - lost[a]


@compiled
def chain_weight(
    chain: Record, masses: Floats, gravity: float, now: Record
) -> tuple[float, float, float]:
    """Tip force that corresponds to the joint torques that support the links."""
    weight = mx = my = 0.0
    for back in range(chain.links):
        k: int = chain.links - 1 - back
        own = gravity * masses[k]
        cx, cy, _ = _apply(now.turns[k], chain.centres[k])
        weight += own
        mx, my = mx + own * (cy + now.origins[k, 1]), my - own * (cx + now.origins[k, 0])
        now.torques[k] = now.axes[k, 0] * mx + now.axes[k, 1] * my + now.moves[k, 2] * weight
    return _tip_force(chain, now)
