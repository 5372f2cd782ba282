"""PD control of spatial objects with gravity compensation and a fixed grip force.

As for planar hands (`slipgrasp.core.kernel.planar.laws.pd_gravity`): the smallest contact forces
produce M_o (K_p e + K_v e') and support the object, in addition to equal normal forces at every
contact; the joints support their links. The attitude error is a rotation vector.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.links import BY_CHAIN, ON_SLIDES, weight_moments
from slipgrasp.core.kernel.spatial.chain_dynamics import chain_weight
from slipgrasp.core.kernel.spatial.dynamics import multiply
from slipgrasp.core.kernel.spatial.grasp import spatial_grasp
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.plant import to_world
from slipgrasp.core.kernel.spatial.workspace import MAX_ASKED, WORKSPACE


@compiled_apart(types.void, MODEL, WORKSPACE, types.float64)
def spatial_grip(model: Record, work: Record, grip: float) -> None:
    """Writes the torque of PD control with a grip as tip forces u = J^-T tau.

    The contact forces are F = F_g + W^+ (d - W F_g): of all F with W F = d, the nearest to the
    grip F_g.

    Args:
        model: Constants of the run.
        work: Errors and estimated model at the measured state; ``tip_forces`` is written.
        grip: Normal force F_g at every contact [N].
    """
    n, kin, force = model.num_fingers, work.kin, work.grasp.force
    _ask_feedback(model, work)
    _take_off_grip(n, work, grip)
    fill_wrench(n, work)
    work.grasp.softens = 0
    spatial_grasp(work.grasp, n, 6, 0)
    for i in range(n):
        force[3 * i + 2] += grip
        x, y, z = to_world(kin, i, force[3 * i], force[3 * i + 1], force[3 * i + 2])
        wx, wy, wz = weight_force(model.hand, work.believed, kin, i)
        work.tip_forces[i, 0], work.tip_forces[i, 1] = x + wx, y + wy
        work.tip_forces[i, 2] = z + wz


@compiled
def _ask_feedback(model: Record, work: Record) -> None:
    """Computes d, the sum of M_o (K_p e + K_v e') and the weight, in ``right``."""
    law, room, right = model.law, work.room, work.believed_system.right
    mass = work.believed.object_mass
    for k in range(6):
        room.bias[k] = (
            law.position_gains[k] * room.error[k] + law.velocity_gains[k] * room.error_rate[k]
        )
    for k in range(3):
        right[k] = mass * room.bias[k]
    right[2] += mass * model.hand.gravity
    right[3], right[4], right[5] = multiply(
        work.believed_system.body, room.bias[3], room.bias[4], room.bias[5]
    )


@compiled
def _take_off_grip(n: int, work: Record, grip: float) -> None:
    """Computes d - W F_g in ``right``."""
    kin, right = work.kin, work.believed_system.right
    for i in range(n):
        x, y, z = to_world(kin, i, 0.0, 0.0, grip)
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        right[0], right[1], right[2] = right[0] - x, right[1] - y, right[2] - z
        right[3] -= ry * z - rz * y
        right[4] -= rz * x - rx * z
        right[5] -= rx * y - ry * x


@compiled
def fill_wrench(n: int, work: Record) -> None:
    """Fills [W | d] of the grasp, with d from ``right``."""
    kin, rows = work.kin, work.grasp.rows
    for k in range(6):
        rows[k, MAX_ASKED] = work.believed_system.right[k]
    work.grasp.fingers, work.grasp.soft = n, 0
    work.grasp.size = 3 * n
    for i in range(n):
        for k in range(3):
            sign = 1.0 if k == 2 else -1.0
            x, y, z = kin.frames[i, k, 0], kin.frames[i, k, 1], kin.frames[i, k, 2]
            rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
            column = 3 * i + k
            rows[0, column], rows[1, column], rows[2, column] = sign * x, sign * y, sign * z
            rows[3, column] = sign * (ry * z - rz * y)
            rows[4, column] = sign * (rz * x - rx * z)
            rows[5, column] = sign * (rx * y - ry * x)


@compiled
def weight_force(hand: Record, believed: Record, kin: Record, i: int) -> tuple[float, float, float]:
    """Tip force of finger ``i`` that supports its moving parts."""
    if hand.kinds[i] == ON_SLIDES:
        return 0.0, 0.0, hand.gravity * believed.link_masses[i, 0]
    if hand.kinds[i] == BY_CHAIN:
        masses = believed.link_masses[i]
        return chain_weight(hand.chains[i], masses, hand.gravity, kin.chains[i])
    inner, outer = weight_moments(hand, believed, kin, i)
    outwards = kin.inverses[i, 0, 0] * inner + kin.inverses[i, 1, 0] * outer
    upwards = kin.inverses[i, 0, 1] * inner + kin.inverses[i, 1, 1] * outer
    return kin.yaws[i, 0] * outwards, kin.yaws[i, 1] * outwards, upwards
