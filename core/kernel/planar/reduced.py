"""Reduced equations M~ x'' + h~ = B~ tau (Eq. 17-18) for any phase, and their regressor.

Forces are in the inertial frame. A slipping contact adds the row delta . F = 0, where
delta = C D^T = x_c + gamma mu n points along the edge of the friction cone; D is that of Eq. 8.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Integers, Record
from slipgrasp.core.kernel.loop.model import FRICTION, OBJECT_INERTIA, OBJECT_MASS
from slipgrasp.core.kernel.numerics.linear import Symmetric
from slipgrasp.core.kernel.planar.kinematics import to_contact_frame
from slipgrasp.core.kernel.planar.state import count_coordinates, slip_coordinate


@compiled
def cone_normal(kin: Record, i: int, phase: int, friction: float) -> tuple[float, float]:
    """Vector delta of contact ``i``: F is on its cone if delta . F = 0; zero in stick."""
    if phase == 0:
        return 0.0, 0.0
    tx, ty = kin.tangents[i, 0], kin.tangents[i, 1]
    slope = phase * friction
    return -tx + slope * ty, -ty - slope * tx


@compiled
def tip_acceleration(kin: Record, i: int, acceleration: Floats) -> tuple[float, float]:
    """Acceleration of fingertip ``i`` for reduced accelerations x'', without its bias."""
    turn, slip = acceleration[2], acceleration[slip_coordinate(i)]
    return (
        acceleration[0] - turn * kin.arms[i, 1] + slip * kin.tangents[i, 0],
        acceleration[1] + turn * kin.arms[i, 0] + slip * kin.tangents[i, 1],
    )


@compiled
def inertial_force(
    kin: Record, dynamics: Record, i: int, acceleration: Floats
) -> tuple[float, float]:
    """Tip force f = Lambda a + f_0 required to move finger ``i`` without contact."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    xx, xy, yy = dynamics.inertia[i, 0], dynamics.inertia[i, 1], dynamics.inertia[i, 2]
    return dynamics.bias[i, 0] + xx * ax + xy * ay, dynamics.bias[i, 1] + xy * ax + yy * ay


@compiled
def assemble_inertia(
    kin: Record, dynamics: Record, truth: Record, phases: Integers, matrix: Floats
) -> None:
    """Computes M~ of Eq. 18, ``(N, N)``; it is not symmetric if a contact slips."""
    n = truth.num_fingers
    body = truth.object_inertia
    total = (body[0], 0.0, 0.0, body[1], 0.0, body[2])
    for i in range(n):
        xx, xy, yy = dynamics.inertia[i, 0], dynamics.inertia[i, 1], dynamics.inertia[i, 2]
        rx, ry = kin.arms[i, 0], kin.arms[i, 1]
        tx, ty = kin.tangents[i, 0], kin.tangents[i, 1]
        total = add_finger(total, xx, xy, yy, rx, ry)
        # Forces on the fingertip per unit of angular acceleration and of slip acceleration.
        px, py = xy * rx - xx * ry, yy * rx - xy * ry
        gx, gy = xx * tx + xy * ty, xy * tx + yy * ty
        row = slip_coordinate(i)
        matrix[0, row], matrix[1, row], matrix[2, row] = gx, gy, rx * gy - ry * gx
        for column in range(3, count_coordinates(n)):
            matrix[row, column] = 0.0
        dx, dy = cone_normal(kin, i, phases[i], truth.friction[i])
        matrix[row, 0], matrix[row, 1] = -xx * dx - xy * dy, -xy * dx - yy * dy
        matrix[row, 2] = -px * dx - py * dy
        matrix[row, row] = 1.0 if phases[i] == 0 else -gx * dx - gy * dy
    matrix[0, 0], matrix[0, 1], matrix[0, 2] = total[0], total[1], total[2]
    matrix[1, 0], matrix[1, 1], matrix[1, 2] = total[1], total[3], total[4]
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = total[2], total[4], total[5]


@compiled
def add_finger(
    total: Symmetric, xx: float, xy: float, yy: float, rx: float, ry: float
) -> Symmetric:
    """Adds the inertia of a sticking finger, Lambda at the arm r, to that of the object."""
    px, py = xy * rx - xx * ry, yy * rx - xy * ry
    m00, m01, m02, m11, m12, m22 = total
    return m00 + xx, m01 + xy, m02 + px, m11 + yy, m12 + py, m22 + rx * py - ry * px


@compiled
def apply_tip_forces(
    kin: Record, truth: Record, phases: Integers, forces: Floats, result: Floats
) -> None:
    """Multiplies [W; -D], the left factor of B~ in Eq. 18, by tip forces ``(n, 2)``."""
    total_x, total_y, moment = 0.0, 0.0, 0.0
    for i in range(truth.num_fingers):
        fx, fy = forces[i, 0], forces[i, 1]
        total_x += fx
        total_y += fy
        moment += kin.arms[i, 0] * fy - kin.arms[i, 1] * fx
        dx, dy = cone_normal(kin, i, phases[i], truth.friction[i])
        result[slip_coordinate(i)] = -dx * fx - dy * fy
    result[0], result[1], result[2] = total_x, total_y, moment


@compiled
def assemble_bias(
    kin: Record,
    dynamics: Record,
    truth: Record,
    gravity: float,
    phases: Integers,
    bias: Floats,
) -> None:
    """Computes h~ of Eq. 18, ``(N,)``."""
    apply_tip_forces(kin, truth, phases, dynamics.bias, bias)
    bias[1] += truth.object_inertia[1] * gravity


@compiled
def torques_to_forces(kin: Record, n: int, torques: Floats, forces: Floats) -> None:
    """Computes u = J^-T tau for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        first, second = torques[i, 0], torques[i, 1]
        forces[i, 0] = kin.inverses[i, 0, 0] * first + kin.inverses[i, 1, 0] * second
        forces[i, 1] = kin.inverses[i, 0, 1] * first + kin.inverses[i, 1, 1] * second


@compiled
def forces_to_torques(kin: Record, n: int, forces: Floats, torques: Floats) -> None:
    """Computes tau = J^T u for every finger, ``(n, 2)`` to ``(n, 2)``."""
    for i in range(n):
        fx, fy = forces[i, 0], forces[i, 1]
        torques[i, 0] = kin.jacobians[i, 0, 0] * fx + kin.jacobians[i, 1, 0] * fy
        torques[i, 1] = kin.jacobians[i, 0, 1] * fx + kin.jacobians[i, 1, 1] * fy


@compiled
def multiply_regressor(
    model: Record, discrete: Record, work: Record, weights: Floats, products: Floats
) -> None:
    """Writes U^T times ``weights``, U of Eq. 21 at the measured x'', to ``products`` ``(p,)``."""
    kin, acceleration, unknowns = work.kin, work.acceleration, model.unknowns
    for k in range(unknowns.count):
        kind, i, link = unknowns.kinds[k], unknowns.fingers[k], unknowns.links[k]
        if kind == OBJECT_MASS:
            lift = acceleration[1] + model.hand.gravity
            products[k] = weights[0] * acceleration[0] + weights[1] * lift
        elif kind == OBJECT_INERTIA:
            products[k] = weights[2] * acceleration[2]
        elif kind == FRICTION:
            fx, fy = inertial_force(kin, work.believed_dynamics, i, acceleration)
            _, normal = to_contact_frame(kin, i, fx, fy)
            products[k] = -discrete.beliefs[i] * normal * weights[slip_coordinate(i)]
        else:
            fx, fy = unit_force(kin, work.unit, i, link, acceleration)
            dx, dy = cone_normal(kin, i, discrete.beliefs[i], work.believed.friction[i])
            wx = weights[0] - kin.arms[i, 1] * weights[2] - dx * weights[slip_coordinate(i)]
            wy = weights[1] + kin.arms[i, 0] * weights[2] - dy * weights[slip_coordinate(i)]
            products[k] = wx * fx + wy * fy


@compiled
def unit_force(
    kin: Record, unit: Record, i: int, link: int, acceleration: Floats
) -> tuple[float, float]:
    """Part of the inertial force of a finger per kg of a link [N/kg]."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    xx, xy, yy = unit.inertia[i, link, 0], unit.inertia[i, link, 1], unit.inertia[i, link, 2]
    return (
        unit.bias[i, link, 0] + xx * ax + xy * ay,
        unit.bias[i, link, 1] + xy * ax + yy * ay,
    )
