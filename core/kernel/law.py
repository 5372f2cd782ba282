"""The adaptive control law, Theorems 3 and 4 (docs/model.md, Controller).

The law sees the state, the phase it believes in and the estimates; true masses and
friction reach it only through `Truth` sets in which the unknown entries are replaced.
"""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.grasp import choose_grasp_force
from core.kernel.kinematics import to_contact_frame, to_inertial_frame
from core.kernel.linear import solve_transposed
from core.kernel.model import FRICTION, LINK_MASS, OBJECT_INERTIA, OBJECT_MASS
from core.kernel.motion import desired_motion
from core.kernel.records import Floats, Integers, Record
from core.kernel.reduced import cone_normal, inertial_force, tip_acceleration
from core.kernel.wrench import distribute_wrench, share_wrench


@compiled
def believe(truth: Record, unknowns: Record, state: Record, believed: Record) -> None:
    """Fills ``believed`` with what the controller knows and what it estimates."""
    believed.num_fingers = truth.num_fingers
    first = 6 + 2 * truth.num_fingers
    for k in range(3):
        believed.object_inertia[k] = truth.object_inertia[k]
    for i in range(truth.num_fingers):
        believed.friction[i] = truth.friction[i]
        for link in range(2):
            believed.link_masses[i, link] = truth.link_masses[i, link]
    for k in range(unknowns.count):
        kind, finger, value = unknowns.kinds[k], unknowns.fingers[k], state.x[first + k]
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
def demand_acceleration(
    law: Record, motion: Record, piece: int, t: float, state: Record, belief: Integers, room: Record
) -> None:
    """V = x''_des + K_v e' + K_p e, with 0 for contacts that are believed to stick."""
    n = law.num_fingers
    for k in range(3):
        position, velocity, acceleration = desired_motion(motion, piece, t, k)
        room.error[k] = position - state.x[k]
        room.error_rate[k] = velocity - state.x[3 + k]
        room.demand[k] = (
            acceleration
            + law.velocity_gains[k] * room.error_rate[k]
            + law.position_gains[k] * room.error[k]
        )
    for i in range(n):
        k = 3 + i
        room.error[k] = -state.x[6 + i]
        room.error_rate[k] = -state.x[6 + n + i]
        room.demand[k] = 0.0 if belief[i] == 0 else law.velocity_gains[k] * room.error_rate[k]


@compiled
def command_forces(model: Record, discrete: Record, work: Record) -> int:
    """Torque of Eq. 23 / 27 as tip forces u = J^-T tau in ``work.tip_forces``.

    B~^+ is applied through G = [W; -D of the slipping contacts], B~ = G J_c^-T: the
    torque that solves B~ tau = M~ v + h~ gives contact forces F^ = u - f^ with G F^ = (d, 0),
    d = M_o v_o + h_o; the internal part of F^ is free (docs/model.md, Grasp force).

    Returns:
        1, or 0 where the rows of G depend on each other.
    """
    n, room, believed = model.num_fingers, work.room, work.believed
    slipping = 0
    for i in range(n):
        slipping += abs(discrete.beliefs[i])
        f0, f1 = inertial_force(work.kin, work.believed_dynamics, i, room.demand)
        room.believed_force[i, 0] = f0
        room.believed_force[i, 1] = f1
    for k in range(3):
        room.right_side[k] = believed.object_inertia[k] * room.demand[k]
    room.right_side[1] += believed.object_inertia[1] * model.hand.gravity
    room.violation = 0.0
    if model.law.grasp_force and slipping == 0:
        regular = share_wrench(work.kin, n, room)
    else:
        regular = distribute_wrench(model, discrete, work)
    if model.law.grasp_force and 3 + slipping == 2 * n - 1:
        room.violation = choose_grasp_force(
            room.contact_force, room.direction, believed, model.law.grip_safety, discrete.beliefs
        )
    for i in range(n):
        along, normal = room.contact_force[i, 0], room.contact_force[i, 1]
        fx, fy = to_inertial_frame(work.kin, i, along, normal)
        work.tip_forces[i, 0] = fx + room.believed_force[i, 0]
        work.tip_forces[i, 1] = fy + room.believed_force[i, 1]
    return regular


@compiled
def weigh_error(law: Record, factors: Record, room: Record) -> None:
    """R = M~^-T E^T P xi of Eq. 46, from the factors of the estimated M~."""
    for k in range(3 + law.num_fingers):
        room.weighted_error[k] = (
            law.lyapunov_12[k] * room.error[k] + law.lyapunov_22[k] * room.error_rate[k]
        )
    solve_transposed(factors, law.num_fingers, room.weighted_error)


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
            products[k] = -discrete.beliefs[i] * normal * weights[3 + i]
        else:
            fx, fy = _unit_force(kin, work.unit, i, link, acceleration)
            dx, dy = cone_normal(kin, i, discrete.beliefs[i], work.believed.friction[i])
            wx = weights[0] - kin.arms[i, 1] * weights[2] - dx * weights[3 + i]
            wy = weights[1] + kin.arms[i, 0] * weights[2] - dy * weights[3 + i]
            products[k] = wx * fx + wy * fy


@compiled
def _unit_force(
    kin: Record, unit: Record, i: int, link: int, acceleration: Floats
) -> tuple[float, float]:
    """What 1 kg of a link takes of the inertial force of its finger."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    xx, xy, yy = unit.inertia[i, link, 0], unit.inertia[i, link, 1], unit.inertia[i, link, 2]
    return (
        unit.bias[i, link, 0] + xx * ax + xy * ay,
        unit.bias[i, link, 1] + xy * ax + yy * ay,
    )


@compiled
def pull_back(law: Record, state: Record, count: int) -> float:
    """sigma_s of Eq. 29; 0 for Theorem 3."""
    if not law.sigma_modification:
        return 0.0
    square, first = 0.0, 6 + 2 * law.num_fingers
    for k in range(count):
        square += state.x[first + k] ** 2
    return min(max(np.sqrt(square) / law.estimate_norm_bound - 1.0, 0.0), 1.0)


@compiled
def lyapunov_value(
    law: Record, truth: Record, unknowns: Record, state: Record, room: Record
) -> float:
    """V of Eq. 44 for the errors in ``room``."""
    value, first = 0.0, 6 + 2 * law.num_fingers
    for k in range(3 + law.num_fingers):
        e, rate = room.error[k], room.error_rate[k]
        value += law.lyapunov_11[k] * e * e + 2.0 * law.lyapunov_12[k] * e * rate
        value += law.lyapunov_22[k] * rate * rate
    for k in range(unknowns.count):
        deviation = true_value(truth, unknowns, k) - state.x[first + k]
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
