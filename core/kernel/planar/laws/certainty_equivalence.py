"""Certainty-equivalence torque (Eq. 23 / 27).

The adaptive laws command the same torque and also update the estimates.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.planar.grasp import choose_grasp_force, keep_limits, minimise_forces
from slipgrasp.core.kernel.planar.kinematics import to_inertial_frame
from slipgrasp.core.kernel.planar.reduced import inertial_force
from slipgrasp.core.kernel.planar.wrench import distribute_wrench, find_squeeze, share_wrench


@compiled
def command_forces(model: Record, discrete: Record, work: Record) -> int:
    """Writes the torque of Eq. 23 / 27 as tip forces u = J^-T tau to ``work.tip_forces``.

    With G = [W; -D of the slipping contacts] and B~ = G J_c^-T, a torque with B~ tau = M~ v + h~
    produces contact forces F^ = u - f^ with G F^ = (d, 0), d = M_o v_o + h_o. The internal part of
    F^ is free (docs/model.md, Grasp force). With the distribution "hold", W F^ = d and every
    contact is kept inside its cone, slipping or not.

    Returns:
        1, or 0 if the rows of G are dependent.
    """
    n, room, believed = model.num_fingers, work.room, work.believed
    slipping = 0
    for i in range(n):
        room.on_cone[i] = 0 if model.law.holds else discrete.beliefs[i]
        slipping += abs(room.on_cone[i])
        f0, f1 = inertial_force(work.kin, work.believed_dynamics, i, room.demand)
        room.believed_force[i, 0] = f0
        room.believed_force[i, 1] = f1
    for k in range(3):
        room.right_side[k] = believed.object_inertia[k] * room.demand[k]
    room.right_side[1] += believed.object_inertia[1] * model.hand.gravity
    room.violation = 0.0
    if model.law.grasp_force and n == 2 and slipping == 0:
        regular = share_wrench(work.kin, n, room)
        find_squeeze(work.kin, room)
        room.violation = choose_grasp_force(
            room.contact_force, room.direction, believed, model.law.grip_safety, room.on_cone
        )
        keep_limits(model, work)
    elif model.law.grasp_force and 3 + slipping < 2 * n:
        regular = minimise_forces(model, work)
    else:
        regular = distribute_wrench(model, work)
    for i in range(n):
        along, normal = room.contact_force[i, 0], room.contact_force[i, 1]
        fx, fy = to_inertial_frame(work.kin, i, along, normal)
        work.tip_forces[i, 0] = fx + room.believed_force[i, 0]
        work.tip_forces[i, 1] = fy + room.believed_force[i, 1]
    return regular
