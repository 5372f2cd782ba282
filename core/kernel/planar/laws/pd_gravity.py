"""PD control of the object with gravity compensation and a fixed grip force.

The contact forces are the smallest that produce M_o (K_p e + K_v e') and support the object,
in addition to equal normal forces at every contact; the joints support their links. Masses are
the initial estimates.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.links import BY_LINKS, ON_SLIDES, weight_moments
from slipgrasp.core.kernel.planar.chain import chain_weight
from slipgrasp.core.kernel.planar.kinematics import posture_of, stored_finger, to_inertial_frame
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.workspace import WORKSPACE
from slipgrasp.core.kernel.planar.wrench import share_wrench


@compiled_apart(types.int64, MODEL, WORKSPACE, types.float64)
def command_grip(model: Record, work: Record, grip: float) -> int:
    """Writes the torque of PD control with a grip as tip forces u = J^-T tau.

    The contact forces are F = F_g + W^+ (d - W F_g): of all F with W F = d, the nearest to the
    grip F_g.

    Args:
        model: Constants of the run.
        work: Evaluated at the measured state; ``tip_forces`` is written.
        grip: Normal force F_g at every contact [N].

    Returns:
        1, or 0 if all contacts coincide.
    """
    n, kin, room = model.num_fingers, work.kin, work.room
    law, body = model.law, work.believed.object_inertia
    for k in range(3):
        feedback = (
            law.position_gains[k] * room.error[k] + law.velocity_gains[k] * room.error_rate[k]
        )
        room.right_side[k] = body[k] * feedback
    room.right_side[1] += body[1] * model.hand.gravity
    for i in range(n):
        fx, fy = to_inertial_frame(kin, i, 0.0, grip)
        room.right_side[0] -= fx
        room.right_side[1] -= fy
        room.right_side[2] -= kin.arms[i, 0] * fy - kin.arms[i, 1] * fx
    regular = share_wrench(kin, n, room)
    room.violation = 0.0
    for i in range(n):
        room.contact_force[i, 1] += grip
        fx, fy = to_inertial_frame(kin, i, room.contact_force[i, 0], room.contact_force[i, 1])
        wx, wy = weight_force(model.nominal, work.believed, kin, i)
        work.tip_forces[i, 0] = fx + wx
        work.tip_forces[i, 1] = fy + wy
    return regular


@compiled
def weight_force(hand: Record, believed: Record, kin: Record, i: int) -> tuple[float, float]:
    """Tip force of finger ``i`` that supports its moving parts."""
    inner, outer = weight_torques(hand, believed, kin, i)
    return (
        kin.inverses[i, 0, 0] * inner + kin.inverses[i, 1, 0] * outer,
        kin.inverses[i, 0, 1] * inner + kin.inverses[i, 1, 1] * outer,
    )


@compiled
def weight_torques(hand: Record, believed: Record, kin: Record, i: int) -> tuple[float, float]:
    """Joint torques of finger ``i`` that support its moving parts [N m, N]."""
    if hand.kinds[i] == BY_LINKS:
        return weight_moments(hand, believed, kin, i)
    if hand.kinds[i] == ON_SLIDES:
        return 0.0, hand.gravity * believed.link_masses[i, 0]
    pose = posture_of(stored_finger(kin, i))
    return chain_weight(hand.chains[i], believed.link_masses[i], pose, hand.gravity)
