"""Gripper law for spatial hands: jaws close with a force and keep their lateral positions.

The arm follows the desired motion, so the target position of jaw i is
p = R_des(t) + exp(r(t)) a_i. The jaw closes along the normal n of its face there with the force F.
With e the offset of the jaw from p, the force K e + D e' acts on it across n; along n, the mean of
these forces over all jaws acts, because the jaws are coupled and self-centring. The law uses the
positions and weights of the jaws, and no data of the object.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.linear import cross
from slipgrasp.core.kernel.spatial.grasp import spatial_grasp
from slipgrasp.core.kernel.spatial.grip import fill_wrench, weight_force
from slipgrasp.core.kernel.spatial.kinematics import rotate
from slipgrasp.core.kernel.spatial.law import desired_turn
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.state import POSITION, STATE
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STATE, WORKSPACE)
def spatial_close(model: Record, discrete: Record, t: float, state: Record, work: Record) -> None:
    """Writes the torque of a gripper as tip forces u = J^-T tau to ``work.tip_forces``.

    Args:
        model: Constants of the run.
        discrete: Discrete state, with the closing force.
        t: Time [s].
        state: Measured state.
        work: Kinematics and estimated model at that state; the tip forces are written to it.
    """
    n, forces, jaws = model.num_fingers, work.tip_forces, work.room.jaws
    _find_rank(n, work)
    _pull_back(model, discrete.piece, t, state, work)
    mean_x = mean_y = mean_z = 0.0
    for i in range(n):
        mean_x += forces[i, 0] / n
        mean_y += forces[i, 1] / n
        mean_z += forces[i, 2] / n
    for i in range(n):
        x, y, z = jaws[i, 0], jaws[i, 1], jaws[i, 2]
        along = forces[i, 0] * x + forces[i, 1] * y + forces[i, 2] * z
        closing = discrete.closing_force + mean_x * x + mean_y * y + mean_z * z - along
        wx, wy, wz = weight_force(model.hand, work.believed, work.kin, i)
        forces[i, 0] += closing * x + wx
        forces[i, 1] += closing * y + wy
        forces[i, 2] += closing * z + wz


@compiled
def _find_rank(n: int, work: Record) -> None:
    """Computes the rank of the grasp, to detect objects that can rotate freely."""
    for k in range(6):
        work.believed_system.right[k] = 0.0
    fill_wrench(n, work)
    work.grasp.softens = 0
    spatial_grasp(work.grasp, n, 6, 0)


@compiled
def _pull_back(model: Record, piece: int, t: float, state: Record, work: Record) -> None:
    """Writes K e + D e' of every jaw to ``tip_forces``, and the closing directions to ``jaws``."""
    hand, law, kin, room = model.hand, model.law, work.kin, work.room
    attitude, (wx, wy, wz), _ = desired_turn(model, piece, t)
    room.bias[0], room.bias[1], room.bias[2], room.bias[3] = attitude
    turn = room.turn
    rotate(room.bias, 0, turn)
    for i in range(model.num_fingers):
        for c in range(3):
            arm = normal = 0.0
            for k in range(3):
                arm += turn[c, k] * hand.anchors[i, k]
                normal += turn[c, k] * hand.frames[i, 2, k]
            room.arm[c], room.jaws[i, c] = arm, normal
        around = cross(wx, wy, wz, room.arm[0], room.arm[1], room.arm[2])
        for c in range(3):
            position, velocity, _ = desired_motion(model.motion, piece, t, c)
            error = position + room.arm[c] - state.x[POSITION + c] - kin.arms[i, c]
            rate = velocity + around[c] - kin.tip_velocities[i, c]
            work.tip_forces[i, c] = law.jaw_stiffness * error + law.jaw_damping * rate
