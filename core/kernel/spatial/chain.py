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
def turned(matrix: Floats, vector: Floats) -> tuple[float, float, float]:
    """Product of a matrix and a vector."""
    x, y, z = vector[0], vector[1], vector[2]
    return (
        matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
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
def to_coordinates(chain: Record, values: Floats, reduced: Floats) -> None:
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
            dx, dy, dz = turned(now.turns[k - 1], chain.places[k])
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
    tx, ty, tz = turned(now.turns[chain.links - 1], chain.tip)
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
