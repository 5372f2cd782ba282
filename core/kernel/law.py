"""The adaptive control law, Theorems 3 and 4 (docs/model.md, Controller).

The law sees the state, the phase it believes in and the estimates; true masses and
friction reach it only through `Truth` sets in which the unknown entries are replaced.
"""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.grasp import choose_grasp_force
from core.kernel.linear import complement, orthonormalize, solve_transposed
from core.kernel.model import (
    FRICTION,
    LINK_MASS,
    OBJECT_INERTIA,
    OBJECT_MASS,
)
from core.kernel.records import (
    MAX_COORDINATES,
    MAX_FINGERS,
    MAX_SIDE,
    Floats,
    Integers,
    Record,
)
from core.kernel.reduced import friction_row, inertial_force, tip_acceleration

DEPENDENT_ROWS = 1e-13


# Intermediate values of the law.
LAW_ROOM = np.dtype(
    [
        ("error", np.float64, (MAX_COORDINATES,)),  # e
        ("error_rate", np.float64, (MAX_COORDINATES,)),
        ("demand", np.float64, (MAX_COORDINATES,)),  # v, the commanded acceleration
        ("believed_force", np.float64, (MAX_FINGERS, 2)),  # f^ of the commanded acceleration
        ("contact_force", np.float64, (MAX_FINGERS, 2)),  # F^ that the torque asks for
        ("basis", np.float64, (MAX_SIDE, MAX_SIDE)),  # G or its transpose, then orthonormal
        ("triangle", np.float64, (MAX_SIDE, MAX_SIDE)),
        ("right_side", np.float64, (MAX_SIDE,)),
        ("direction", np.float64, (MAX_SIDE,)),  # null space of G
        ("weighted_error", np.float64, (MAX_COORDINATES,)),  # r of Eq. 46
        ("violation", np.float64),  # of the estimated cones by the commanded force [N]
    ],
    align=True,
)


@compiled
def believe(truth: Record, unknowns: Record, estimates: Floats, believed: Record) -> None:
    """Fills ``believed`` with what the controller knows and what it estimates."""
    believed.num_fingers = truth.num_fingers
    for k in range(3):
        believed.object_inertia[k] = truth.object_inertia[k]
    for i in range(truth.num_fingers):
        believed.friction[i] = truth.friction[i]
        for link in range(2):
            believed.link_masses[i, link] = truth.link_masses[i, link]
    for k in range(unknowns.count):
        kind, finger, value = unknowns.kinds[k], unknowns.fingers[k], estimates[k]
        if kind == OBJECT_MASS:
            believed.object_inertia[0] = value
            believed.object_inertia[1] = value
        elif kind == OBJECT_INERTIA:
            believed.object_inertia[2] = value
        elif kind == FRICTION:
            believed.friction[finger] = value
        elif kind == LINK_MASS:
            believed.link_masses[finger, unknowns.links[k]] = value


@compiled
def desired_motion(
    motion: Record, piece: int, t: float, coordinate: int
) -> tuple[float, float, float]:
    """Desired position, velocity, acceleration of one coordinate on a piece of Eq. 64.

    The piece is given, not found from ``t``, so that values at a break are one-sided.
    """
    begin = motion.start[coordinate]
    slope = motion.acceleration[coordinate]
    first, second, third = motion.breaks[0], motion.breaks[1], motion.breaks[2]
    if piece == 0:
        return begin + 0.5 * slope * t * t, slope * t, slope
    speed = slope * first
    begin += 0.5 * slope * first * first
    if piece == 1:
        return begin + speed * (t - first), speed, 0.0
    begin += speed * (second - first)
    if piece == 2:
        s = t - second
        return begin + speed * s - 0.5 * slope * s * s, speed - slope * s, -slope
    s = third - second
    return begin + speed * s - 0.5 * slope * s * s, 0.0, 0.0


@compiled
def demand_acceleration(
    law: Record, motion: Record, piece: int, t: float, state: Floats, belief: Integers, room: Record
) -> None:
    """V = x''_des + K_v e' + K_p e, with 0 for contacts that are believed to stick."""
    n = law.num_fingers
    for k in range(3):
        position, velocity, acceleration = desired_motion(motion, piece, t, k)
        room.error[k] = position - state[k]
        room.error_rate[k] = velocity - state[3 + k]
        room.demand[k] = (
            acceleration
            + law.velocity_gains[k] * room.error_rate[k]
            + law.position_gains[k] * room.error[k]
        )
    for i in range(n):
        k = 3 + i
        room.error[k] = -state[6 + i]
        room.error_rate[k] = -state[6 + n + i]
        room.demand[k] = 0.0 if belief[i] == 0 else law.velocity_gains[k] * room.error_rate[k]


@compiled
def command_forces(
    law: Record,
    kin: Record,
    believed: Record,
    dynamics: Record,
    gravity: float,
    belief: Integers,
    room: Record,
    tip_forces: Floats,
) -> bool:
    """Torque of Eq. 23 / 27 as contact-frame forces u = J_c^-T tau, ``(n, 2)``.

    B~^+ is applied through G = [W; -D of the slipping contacts], B~ = G J_c^-T: the
    torque that solves B~ tau = M~ v + h~ gives contact forces F^ = u - f^ with G F^ = (d, 0),
    d = M_o v_o + h_o; the internal part of F^ is free (docs/model.md, Grasp force).

    Returns:
        False where the rows of G depend on each other.
    """
    n = believed.num_fingers
    rows = _assemble_wrench_rows(kin, believed, gravity, belief, room)
    for i in range(n):
        f0, f1 = inertial_force(kin, dynamics, i, room.demand)
        room.believed_force[i, 0] = f0
        room.believed_force[i, 1] = f1
    solvable = rows <= 2 * n
    least_torque = solvable and not law.grasp_force
    if least_torque:
        _weigh_by_torque(rows, n, kin, room)
    if not solvable:
        _transpose(room.basis, rows)
    least = orthonormalize(room.basis, room.triangle, max(rows, 2 * n), min(rows, 2 * n))
    room.violation = 0.0
    if solvable:
        _solve_least_norm(rows, 2 * n, room)
    else:
        _solve_least_squares(rows, 2 * n, room)
    if least_torque:
        torques_to_forces(kin, n, room.contact_force, tip_forces)
        for i in range(n):
            for axis in range(2):
                room.contact_force[i, axis] = tip_forces[i, axis] - room.believed_force[i, axis]
        return least > DEPENDENT_ROWS
    if rows == 2 * n - 1:
        complement(room.basis, 2 * n, rows, room.direction)
        room.violation = choose_grasp_force(
            room.contact_force, room.direction, believed, law.grip_safety, belief
        )
    for i in range(n):
        for axis in range(2):
            tip_forces[i, axis] = room.contact_force[i, axis] + room.believed_force[i, axis]
    return least > DEPENDENT_ROWS


@compiled
def _assemble_wrench_rows(
    kin: Record, believed: Record, gravity: float, belief: Integers, room: Record
) -> int:
    """Writes G transposed into ``basis`` and (d, 0) into ``right_side``; returns the rows of G."""
    n = believed.num_fingers
    rows = 3
    for i in range(2 * n):
        for k in range(3 + n):
            room.basis[i, k] = 0.0
    for k in range(3):
        room.right_side[k] = believed.object_inertia[k] * room.demand[k]
    room.right_side[1] += believed.object_inertia[1] * gravity
    for i in range(n):
        for axis in range(2):
            room.basis[2 * i + axis, 0] = kin.frames[i, 0, axis]
            room.basis[2 * i + axis, 1] = kin.frames[i, 1, axis]
            room.basis[2 * i + axis, 2] = kin.moments[i, axis]
        if belief[i] != 0:
            d0, d1 = friction_row(belief[i], believed.friction[i])
            room.basis[2 * i, rows] = -d0
            room.basis[2 * i + 1, rows] = -d1
            room.right_side[rows] = 0.0
            rows += 1
    return rows


@compiled
def _transpose(matrix: Floats, size: int) -> None:
    for i in range(size):
        for j in range(i):
            matrix[i, j], matrix[j, i] = matrix[j, i], matrix[i, j]


@compiled
def _solve_least_norm(rows: int, columns: int, room: Record) -> None:
    """F^ = G^+ (d, 0) from the QR factors of G^T, where G has no more rows than columns."""
    for i in range(rows):
        for j in range(i):
            room.right_side[i] -= room.triangle[j, i] * room.right_side[j]
        room.right_side[i] /= room.triangle[i, i]
    for i in range(columns):
        total = 0.0
        for k in range(rows):
            total += room.basis[i, k] * room.right_side[k]
        room.contact_force[i // 2, i % 2] = total


@compiled
def _solve_least_squares(rows: int, columns: int, room: Record) -> None:
    """F^ = G^+ (d, 0) from the QR factors of G, where G has more rows than columns."""
    for k in range(columns - 1, -1, -1):
        total = 0.0
        for i in range(rows):
            total += room.basis[i, k] * room.right_side[i]
        for j in range(k + 1, columns):
            total -= room.triangle[k, j] * room.contact_force[j // 2, j % 2]
        room.contact_force[k // 2, k % 2] = total / room.triangle[k, k]


@compiled
def _weigh_by_torque(rows: int, n: int, kin: Record, room: Record) -> None:
    """From G F^ = (d, 0) to B~ tau = M~ v + h~ (y = 0): least torque, not least contact force."""
    for i in range(n):
        for k in range(rows):
            first, second = room.basis[2 * i, k], room.basis[2 * i + 1, k]
            room.right_side[k] += first * room.believed_force[i, 0]
            room.right_side[k] += second * room.believed_force[i, 1]
            wx = kin.frames[i, 0, 0] * first + kin.frames[i, 0, 1] * second
            wy = kin.frames[i, 1, 0] * first + kin.frames[i, 1, 1] * second
            room.basis[2 * i, k] = kin.inverses[i, 0, 0] * wx + kin.inverses[i, 0, 1] * wy
            room.basis[2 * i + 1, k] = kin.inverses[i, 1, 0] * wx + kin.inverses[i, 1, 1] * wy


@compiled
def torques_to_forces(kin: Record, n: int, torques: Floats, tip_forces: Floats) -> None:
    """U = J_c^-T tau for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        inverse, frame = kin.inverses[i], kin.frames[i]
        wx = inverse[0, 0] * torques[i, 0] + inverse[1, 0] * torques[i, 1]
        wy = inverse[0, 1] * torques[i, 0] + inverse[1, 1] * torques[i, 1]
        tip_forces[i, 0] = frame[0, 0] * wx + frame[1, 0] * wy
        tip_forces[i, 1] = frame[0, 1] * wx + frame[1, 1] * wy


@compiled
def forces_to_torques(kin: Record, n: int, tip_forces: Floats, torques: Floats) -> None:
    """Tau = J_c^T u for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        jacobian, frame = kin.jacobians[i], kin.frames[i]
        wx = frame[0, 0] * tip_forces[i, 0] + frame[0, 1] * tip_forces[i, 1]
        wy = frame[1, 0] * tip_forces[i, 0] + frame[1, 1] * tip_forces[i, 1]
        torques[i, 0] = jacobian[0, 0] * wx + jacobian[1, 0] * wy
        torques[i, 1] = jacobian[0, 1] * wx + jacobian[1, 1] * wy


@compiled
def weigh_error(law: Record, factors: Floats, pivots: Integers, room: Record) -> None:
    """R = M~^-T E^T P xi of Eq. 46, from the factors of the estimated M~."""
    size = 3 + law.num_fingers
    for k in range(size):
        room.weighted_error[k] = (
            law.lyapunov_12[k] * room.error[k] + law.lyapunov_22[k] * room.error_rate[k]
        )
    solve_transposed(factors, pivots, size, room.weighted_error)


@compiled
def regressor_product(
    kin: Record,
    unit: Record,
    dynamics: Record,
    believed: Record,
    unknowns: Record,
    gravity: float,
    belief: Integers,
    acceleration: Floats,
    weights: Floats,
    k: int,
) -> float:
    """Column k of the regressor U (Eq. 21), evaluated at x'', times ``weights``."""
    kind, i = unknowns.kinds[k], unknowns.fingers[k]
    if kind == OBJECT_MASS:
        return weights[0] * acceleration[0] + weights[1] * (acceleration[1] + gravity)
    if kind == OBJECT_INERTIA:
        return weights[2] * acceleration[2]
    if kind == FRICTION:
        if belief[i] == 0:
            return 0.0
        _, normal = inertial_force(kin, dynamics, i, acceleration)
        return -belief[i] * normal * weights[3 + i]
    link = unknowns.links[k]
    ax, ay = tip_acceleration(kin, i, acceleration)
    inertia, bias = unit.inertia[i, link], unit.bias[i, link]
    f0 = bias[0] + inertia[0, 0] * ax + inertia[0, 1] * ay
    f1 = bias[1] + inertia[1, 0] * ax + inertia[1, 1] * ay
    d0, d1 = friction_row(belief[i], believed.friction[i])
    frame = kin.frames[i]
    w0 = frame[0, 0] * weights[0] + frame[1, 0] * weights[1] + kin.moments[i, 0] * weights[2]
    w1 = frame[0, 1] * weights[0] + frame[1, 1] * weights[1] + kin.moments[i, 1] * weights[2]
    return (w0 - d0 * weights[3 + i]) * f0 + (w1 - d1 * weights[3 + i]) * f1


@compiled
def pull_back(law: Record, estimates: Floats, count: int) -> float:
    """sigma_s of Eq. 29; 0 for Theorem 3."""
    if not law.sigma_modification:
        return 0.0
    square = 0.0
    for k in range(count):
        square += estimates[k] ** 2
    return min(max(np.sqrt(square) / law.estimate_norm_bound - 1.0, 0.0), 1.0)


@compiled
def lyapunov_value(
    law: Record, truth: Record, unknowns: Record, estimates: Floats, room: Record
) -> float:
    """V of Eq. 44 for the errors in ``room``."""
    value = 0.0
    for k in range(3 + law.num_fingers):
        e, rate = room.error[k], room.error_rate[k]
        value += law.lyapunov_11[k] * e * e + 2.0 * law.lyapunov_12[k] * e * rate
        value += law.lyapunov_22[k] * rate * rate
    for k in range(unknowns.count):
        deviation = true_value(truth, unknowns, k) - estimates[k]
        value += deviation**2 / law.adaptation_gains[k]
    return value


@compiled
def true_value(truth: Record, unknowns: Record, k: int) -> float:
    """True value of unknown k."""
    kind, finger = unknowns.kinds[k], unknowns.fingers[k]
    if kind == OBJECT_MASS:
        return truth.object_inertia[0]
    if kind == OBJECT_INERTIA:
        return truth.object_inertia[2]
    if kind == FRICTION:
        return truth.friction[finger]
    return truth.link_masses[finger, unknowns.links[k]]
