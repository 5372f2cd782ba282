"""Common functions of the control laws for spatial hands (docs/space.md, The controller).

The attitude error is the rotation vector rho of R = exp(rho) R_des. In these coordinates e, e' and
the demand are those of the paper: e_theta = -rho, omega = A(rho) rho' + exp(rho) omega_des.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.model import (
    FRICTION,
    OBJECT_INERTIA,
    OBJECT_MASS,
    make_true_value,
)
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.elementary import atan2, sincos, square
from slipgrasp.core.kernel.numerics.linear import cross
from slipgrasp.core.kernel.numerics.lyapunov import error_value, error_weights
from slipgrasp.core.kernel.spatial.dynamics import multiply
from slipgrasp.core.kernel.spatial.kinematics import rotate
from slipgrasp.core.kernel.spatial.plant import own_force, tip_acceleration, to_contact_frame
from slipgrasp.core.kernel.spatial.state import (
    ATTITUDE,
    BODY_STATES,
    POSITION,
    SPIN,
    VELOCITY,
    count_coordinates,
    slip_at,
    slip_coordinate,
    slip_velocity_at,
)
from slipgrasp.core.kernel.spatial.ways import axes_of
from slipgrasp.core.kernel.spatial.workspace import STICK

LEAST_BRAKE = 0.01  # fraction of slip_stop, prevents creep
SMALL_ANGLE = 1e-3


@compiled
def believe(model: Record, estimates: Floats, believed: Record) -> None:
    """Sets ``believed`` to the known and estimated parameters."""
    truth, unknowns = model.truth, model.unknowns
    believed.num_fingers = truth.num_fingers
    believed.object_mass = truth.object_mass
    for k in range(3):
        believed.inertias[k] = truth.inertias[k]
    for i in range(truth.num_fingers):
        believed.friction[i] = truth.friction[i]
        for link in range(truth.link_masses.shape[1]):
            believed.link_masses[i, link] = model.law.link_mass_ratio * truth.link_masses[i, link]
    for k in range(unknowns.count):
        kind, finger = unknowns.kinds[k], unknowns.fingers[k]
        if kind == OBJECT_MASS:
            believed.object_mass = estimates[k]
        elif kind == OBJECT_INERTIA:
            believed.inertias[unknowns.links[k]] = estimates[k]
        elif kind == FRICTION:
            believed.friction[finger] = estimates[k]
        else:
            believed.link_masses[finger, unknowns.links[k]] = estimates[k]


@compiled
def _object_value(truth: Record, unknowns: Record, k: int) -> float:
    """Mass or moment of inertia of the object."""
    is_mass = unknowns.kinds[k] == OBJECT_MASS
    return truth.object_mass if is_mass else truth.inertias[unknowns.links[k]]


true_value = make_true_value(_object_value)


@compiled
def _coefficients(angle: float) -> tuple[float, float, float, float]:
    """(1 - cos x)/x^2 and (x - sin x)/x^3, and their derivatives divided by x."""
    s = angle * angle
    if angle < SMALL_ANGLE:
        return (
            0.5 - s / 24.0 + s * s / 720.0,
            1.0 / 6.0 - s / 120.0 + s * s / 5040.0,
            -1.0 / 12.0 + s / 180.0,
            -1.0 / 60.0 + s / 1260.0,
        )
    sine, cosine = sincos(angle)
    a, b = (1.0 - cosine) / s, (angle - sine) / (s * angle)
    return a, b, (sine / angle - 2.0 * a) / s, ((1.0 - cosine) / s - 3.0 * b) / s


@compiled
def _jacobian_times(
    a: float, b: float, rho: tuple[float, float, float], x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Product of A(rho) = I + a S(rho) + b S(rho)^2 and a vector."""
    px, py, pz = cross(rho[0], rho[1], rho[2], x, y, z)
    qx, qy, qz = cross(rho[0], rho[1], rho[2], px, py, pz)
    return x + a * px + b * qx, y + a * py + b * qy, z + a * pz + b * qz


@compiled
def _jacobian_rate_times(
    coefficients: tuple[float, float, float, float],
    rho: tuple[float, float, float],
    rate: tuple[float, float, float],
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float]:
    """Product of the time derivative of A(rho) and a vector, for the rate of rho."""
    a, b, da, db = coefficients
    along = rho[0] * rate[0] + rho[1] * rate[1] + rho[2] * rate[2]
    px, py, pz = cross(rho[0], rho[1], rho[2], x, y, z)
    qx, qy, qz = cross(rho[0], rho[1], rho[2], px, py, pz)
    sx, sy, sz = cross(rate[0], rate[1], rate[2], x, y, z)
    ux, uy, uz = cross(rate[0], rate[1], rate[2], px, py, pz)
    vx, vy, vz = cross(rho[0], rho[1], rho[2], sx, sy, sz)
    return (
        along * (da * px + db * qx) + a * sx + b * (ux + vx),
        along * (da * py + db * qy) + a * sy + b * (uy + vy),
        along * (da * pz + db * qz) + a * sz + b * (uz + vz),
    )


@compiled
def exponential(rho: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Unit quaternion of a rotation vector."""
    angle = np.sqrt(rho[0] * rho[0] + rho[1] * rho[1] + rho[2] * rho[2])
    sine, cosine = sincos(0.5 * angle)
    scale = sine / angle if angle > 1e-8 else 0.5
    return cosine, scale * rho[0], scale * rho[1], scale * rho[2]


@compiled
def product(
    p: tuple[float, float, float, float], q: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Product of two quaternions."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@compiled
def _logarithm(q: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Rotation vector of a unit quaternion, with a length of at most pi."""
    length = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    sign = 1.0 if q[0] >= 0.0 else -1.0
    scale = 2.0 * atan2(length, sign * q[0]) / length * sign if length > 1e-12 else 2.0 * sign
    return scale * q[1], scale * q[2], scale * q[3]


@compiled
def update_errors(model: Record, piece: int, t: float, state: Record, room: Record) -> None:
    """Computes e, e' and the demand v as if every contact slipped, without slip_stop."""
    x, n, law = state.x, model.num_fingers, model.law
    update_object_errors(model, piece, t, state, room)
    for i in range(n):
        for axis in range(2):
            k = slip_coordinate(i, axis)
            room.error[k] = -x[slip_at(i, axis)]
            room.error_rate[k] = -x[slip_velocity_at(n, i, axis)]
            room.slip_demand[i, axis] = (
                law.velocity_gains[k] * room.error_rate[k] + law.position_gains[k] * room.error[k]
            )


@compiled
def update_object_errors(model: Record, piece: int, t: float, state: Record, room: Record) -> None:
    """Computes the part of the object, unless it is already up to date for this state."""
    if _are_known(piece, t, state, room):
        return
    _update_shift(model, piece, t, state, room)
    _update_turn(model, piece, t, state, room)
    room.known_time, room.known_piece = t, piece
    for k in range(BODY_STATES):
        room.known_state[k] = state.x[k]


@compiled
def _are_known(piece: int, t: float, state: Record, room: Record) -> bool:
    """True if the errors of the object in ``room`` belong to this state."""
    if t != room.known_time or piece != room.known_piece:
        return False
    for k in range(BODY_STATES):
        if state.x[k] != room.known_state[k]:
            return False
    return True


@compiled
def forget_errors(room: Record) -> None:
    """Invalidates the errors of the object after a change of constants."""
    room.known_time = np.nan


@compiled
def leave_stuck(n: int, slips: Floats, room: Record) -> None:
    """Sets error and demand of sticking tangents to zero."""
    for i in range(n):
        for axis in range(2):
            if slips[i, axis] == 0.0:
                room.error[slip_coordinate(i, axis)] = room.slip_demand[i, axis] = 0.0


@compiled
def desired_turn(
    model: Record, piece: int, t: float
) -> tuple[
    tuple[float, float, float, float], tuple[float, float, float], tuple[float, float, float]
]:
    """Desired attitude exp(r) R_start, angular velocity A r' and angular acceleration."""
    motion = model.motion
    rx, vx, ax = desired_motion(motion, piece, t, 3)
    ry, vy, ay = desired_motion(motion, piece, t, 4)
    rz, vz, az = desired_motion(motion, piece, t, 5)
    turned, rates = (rx, ry, rz), (vx, vy, vz)
    own = _coefficients(np.sqrt(rx * rx + ry * ry + rz * rz))
    spin = _jacobian_times(own[0], own[1], turned, vx, vy, vz)
    bx, by, bz = _jacobian_times(own[0], own[1], turned, ax, ay, az)
    cx, cy, cz = _jacobian_rate_times(own, turned, rates, vx, vy, vz)
    start = (model.attitude[0], model.attitude[1], model.attitude[2], model.attitude[3])
    return product(exponential(turned), start), spin, (bx + cx, by + cy, bz + cz)


@compiled
def _update_shift(model: Record, piece: int, t: float, state: Record, room: Record) -> None:
    """Computes the position error, its rate and the demanded acceleration."""
    x, law = state.x, model.law
    for k in range(3):
        position, velocity, acceleration = desired_motion(model.motion, piece, t, k)
        room.error[k] = position - x[POSITION + k]
        room.error_rate[k] = velocity - x[VELOCITY + k]
        room.demand[k] = (
            acceleration
            + law.velocity_gains[k] * room.error_rate[k]
            + law.position_gains[k] * room.error[k]
        )


@compiled
def _update_turn(model: Record, piece: int, t: float, state: Record, room: Record) -> None:
    """Computes the attitude error, its rate and the demanded angular acceleration."""
    x, law = state.x, model.law
    desired, (wx, wy, wz), (bx, by, bz) = desired_turn(model, piece, t)
    present = (x[ATTITUDE], x[ATTITUDE + 1], x[ATTITUDE + 2], x[ATTITUDE + 3])
    back = (desired[0], -desired[1], -desired[2], -desired[3])
    error = product(present, back)
    rho = _logarithm(error)
    turn = room.rotation
    room.bias[0], room.bias[1], room.bias[2], room.bias[3] = error
    rotate(room.bias, 0, turn)
    ox = turn[0, 0] * wx + turn[0, 1] * wy + turn[0, 2] * wz
    oy = turn[1, 0] * wx + turn[1, 1] * wy + turn[1, 2] * wz
    oz = turn[2, 0] * wx + turn[2, 1] * wy + turn[2, 2] * wz
    ex, ey, ez = x[SPIN] - ox, x[SPIN + 1] - oy, x[SPIN + 2] - oz
    angle = np.sqrt(rho[0] * rho[0] + rho[1] * rho[1] + rho[2] * rho[2])
    terms = _coefficients(angle)
    rate = _solve_jacobian(terms, rho, angle, ex, ey, ez)
    jx = _second(law, 3, rho[0], rate[0])
    jy = _second(law, 4, rho[1], rate[1])
    jz = _second(law, 5, rho[2], rate[2])
    px, py, pz = _jacobian_times(terms[0], terms[1], rho, jx, jy, jz)
    qx, qy, qz = _jacobian_rate_times(terms, rho, rate, rate[0], rate[1], rate[2])
    # d/dt (exp(rho) w_des) = (w - exp(rho) w_des) x exp(rho) w_des + exp(rho) w_des'.
    kx, ky, kz = cross(ex, ey, ez, ox, oy, oz)
    room.demand[3] = px + qx + kx + turn[0, 0] * bx + turn[0, 1] * by + turn[0, 2] * bz
    room.demand[4] = py + qy + ky + turn[1, 0] * bx + turn[1, 1] * by + turn[1, 2] * bz
    room.demand[5] = pz + qz + kz + turn[2, 0] * bx + turn[2, 1] * by + turn[2, 2] * bz
    for k in range(3):
        room.error[3 + k], room.error_rate[3 + k] = -rho[k], -rate[k]
    for k in range(3):
        x0, y0, z0 = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        c0, c1, c2 = _jacobian_times(terms[0], terms[1], rho, x0, y0, z0)
        turn[0, k], turn[1, k], turn[2, k] = c0, c1, c2


@compiled
def _second(law: Record, k: int, value: float, rate: float) -> float:
    return -law.velocity_gains[k] * rate - law.position_gains[k] * value


@compiled
def _solve_jacobian(
    terms: tuple[float, float, float, float],
    rho: tuple[float, float, float],
    angle: float,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float]:
    """Product of A(rho)^-1 = I - S/2 + (1/|rho|^2)(1 - (1 - b|rho|^2)/(2a)) S^2 and a vector."""
    a, b = terms[0], terms[1]
    s = angle * angle
    if angle < SMALL_ANGLE:
        factor = 1.0 / 12.0 + s / 720.0
    else:
        factor = (1.0 - (1.0 - b * s) / (2.0 * a)) / s
    px, py, pz = cross(rho[0], rho[1], rho[2], x, y, z)
    qx, qy, qz = cross(rho[0], rho[1], rho[2], px, py, pz)
    return (
        x - 0.5 * px + factor * qx,
        y - 0.5 * py + factor * qy,
        z - 0.5 * pz + factor * qz,
    )


@compiled
def tilt(room: Record) -> float:
    """|rho| of the errors [rad]."""
    return np.sqrt(square(room.error[3]) + square(room.error[4]) + square(room.error[5]))


@compiled
def brake_slips(model: Record, discrete: Record, state: Record, room: Record) -> None:
    """Adds a deceleration of up to slip_stop to the demand of contacts in estimated slip."""
    n, law = model.num_fingers, model.law
    for i in range(n):
        if discrete.beliefs[i] == STICK or not law.slip_stop > 0.0:
            continue
        for way in range(model.ways):
            speed = 0.0
            for axis in axes_of(model, way):
                speed += room.gamma[i, axis] * state.x[slip_velocity_at(n, i, axis)]
            # Hardly more than is needed to stop before the next torque acts, as in the planar law.
            stopping = max(speed, 0.0) / (law.period + law.latency)
            brake = min(law.slip_stop, stopping + LEAST_BRAKE * law.slip_stop)
            for axis in axes_of(model, way):
                room.slip_demand[i, axis] -= brake * room.gamma[i, axis]


@compiled
def lyapunov_value(model: Record, estimates: Floats, room: Record) -> float:
    """V of Eq. 44 for the errors in ``room``."""
    law = model.law
    value = error_value(law, room, count_coordinates(model.num_fingers))
    for k in range(model.num_unknowns):
        deviation = true_value(model.truth, model.unknowns, k) - estimates[k]
        value += square(deviation) / law.adaptation_gains[k]
    return value


@compiled
def weights_of_error(model: Record, room: Record) -> None:
    """Computes blkdiag(I, A^-T, I) E^T P xi in ``weights``, for up-to-date errors and A."""
    law, weights, a = model.law, room.weights, room.rotation
    error_weights(law, room, count_coordinates(model.num_fingers), weights)
    # A^-T by Cramer's rule.
    c00, c01, c02 = cross(a[0, 1], a[1, 1], a[2, 1], a[0, 2], a[1, 2], a[2, 2])
    c10, c11, c12 = cross(a[0, 2], a[1, 2], a[2, 2], a[0, 0], a[1, 0], a[2, 0])
    c20, c21, c22 = cross(a[0, 0], a[1, 0], a[2, 0], a[0, 1], a[1, 1], a[2, 1])
    inverse = 1.0 / (a[0, 0] * c00 + a[1, 0] * c01 + a[2, 0] * c02)
    x, y, z = inverse * weights[3], inverse * weights[4], inverse * weights[5]
    weights[3] = c00 * x + c10 * y + c20 * z
    weights[4] = c01 * x + c11 * y + c21 * z
    weights[5] = c02 * x + c12 * y + c22 * z


@compiled
def inertia_column(
    kin: Record, state: Record, acceleration: Floats, k: int
) -> tuple[float, float, float]:
    """Moment per principal inertia e: e (e.w') + w x e (e.w) [N m / (kg m^2)]."""
    ex, ey, ez = kin.rotation[0, k], kin.rotation[1, k], kin.rotation[2, k]
    wx, wy, wz = state.x[SPIN], state.x[SPIN + 1], state.x[SPIN + 2]
    turning = ex * acceleration[3] + ey * acceleration[4] + ez * acceleration[5]
    spinning = ex * wx + ey * wy + ez * wz
    px, py, pz = cross(wx, wy, wz, ex, ey, ez)
    return ex * turning + px * spinning, ey * turning + py * spinning, ez * turning + pz * spinning


@compiled
def unit_force(kin: Record, work: Record, i: int, link: int) -> tuple[float, float, float]:
    """Part of the inertial force of a finger per kg of a link, for the measured acceleration."""
    x, y, z = tip_acceleration(
        kin, i, work.acceleration, work.slip_acceleration[i, 0], work.slip_acceleration[i, 1]
    )
    fx, fy, fz = multiply(work.unit.inertia[i, link], x, y, z)
    bias = work.unit.bias[i, link]
    return fx + bias[0], fy + bias[1], fz + bias[2]


@compiled
def multiply_regressor(model: Record, state: Record, work: Record, weights: Floats) -> None:
    """Writes U^T times ``weights``, U of Eq. 21 for the measured acceleration, to ``rates``."""
    kin, a, unknowns, system = work.kin, work.acceleration, model.unknowns, work.believed_system
    for k in range(unknowns.count):
        kind, i, link = unknowns.kinds[k], unknowns.fingers[k], unknowns.links[k]
        if kind == OBJECT_MASS:
            lift = a[2] + model.hand.gravity
            work.rates[k] = weights[0] * a[0] + weights[1] * a[1] + weights[2] * lift
        elif kind == OBJECT_INERTIA:
            x, y, z = inertia_column(kin, state, a, link)
            work.rates[k] = weights[3] * x + weights[4] * y + weights[5] * z
        elif kind == FRICTION:
            x, y, z = own_force(kin, work.believed_dynamics, i, a, work.slip_acceleration)
            _, _, normal = to_contact_frame(kin, i, x, y, z)
            gamma, slips = work.room.gamma[i], work.room.slips[i]
            along = slips[0] * gamma[0] * weights[slip_coordinate(i, 0)]
            along += slips[1] * gamma[1] * weights[slip_coordinate(i, 1)]
            work.rates[k] = -normal * along
        else:
            fx, fy, fz = unit_force(kin, work, i, link)
            rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
            px, py, pz = cross(weights[3], weights[4], weights[5], rx, ry, rz)
            e, first, second = (
                system.normals[i],
                weights[slip_coordinate(i, 0)],
                weights[slip_coordinate(i, 1)],
            )
            work.rates[k] = (
                fx * (weights[0] + px + first * e[0, 0] + second * e[1, 0])
                + fy * (weights[1] + py + first * e[0, 1] + second * e[1, 1])
                + fz * (weights[2] + pz + first * e[0, 2] + second * e[1, 2])
            )
