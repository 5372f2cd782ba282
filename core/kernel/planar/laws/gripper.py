"""Gripper law for planar hands (spatial hands: `slipgrasp.core.kernel.spatial.gripper`).

The arm follows the desired motion, so the target position of jaw i is
p = R_des(t) + exp(theta_des(t)) a_i. The jaw closes along the normal n of its face there with the
force F. With e the offset of the jaw from p, the force K e + D e' acts on it across n; along n,
the mean of these forces over all jaws acts.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.elementary import sincos
from slipgrasp.core.kernel.planar.kinematics import place_contact
from slipgrasp.core.kernel.planar.laws.pd_gravity import weight_force
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import ANGLE, STATE, X, Y
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE


@compiled_apart(types.int64, MODEL, DISCRETE, types.float64, STATE, WORKSPACE)
def close_jaws(model: Record, discrete: Record, t: float, state: Record, work: Record) -> int:
    """Writes the torque of a gripper as tip forces u = J^-T tau to ``work.tip_forces``.

    Args:
        model: Constants of the run.
        discrete: Discrete state, with the closing force.
        t: Time [s].
        state: Measured state.
        work: Kinematics and estimated model at that state; the tip forces are written to it.

    Returns:
        1: the law always has a solution.
    """
    n, forces = model.num_fingers, work.tip_forces
    sine, cosine = _pull_back(model, discrete.piece, t, state, work)
    mean_x = mean_y = 0.0
    for i in range(n):
        mean_x += forces[i, 0] / n
        mean_y += forces[i, 1] / n
    for i in range(n):
        tx, ty, _, _ = place_contact(model.hand, i, 0.0, cosine, sine)
        nx, ny = ty, -tx
        along = forces[i, 0] * nx + forces[i, 1] * ny
        closing = discrete.closing_force + mean_x * nx + mean_y * ny - along
        wx, wy = weight_force(model.nominal, work.believed, work.kin, i)
        forces[i, 0] += closing * nx + wx
        forces[i, 1] += closing * ny + wy
    work.room.violation = 0.0
    return 1


@compiled
def _pull_back(
    model: Record, piece: int, t: float, state: Record, work: Record
) -> tuple[float, float]:
    """Writes K e + D e' to ``tip_forces``; returns sine and cosine of the desired angle."""
    law, kin = model.law, work.kin
    x, vx, _ = desired_motion(model.motion, piece, t, X)
    y, vy, _ = desired_motion(model.motion, piece, t, Y)
    angle, omega, _ = desired_motion(model.motion, piece, t, ANGLE)
    sine, cosine = sincos(angle)
    for i in range(model.num_fingers):
        _, _, rx, ry = place_contact(model.hand, i, 0.0, cosine, sine)
        error_x = x + rx - state.x[X] - kin.arms[i, 0]
        error_y = y + ry - state.x[Y] - kin.arms[i, 1]
        rate_x = vx - omega * ry - kin.tip_velocities[i, 0]
        rate_y = vy + omega * rx - kin.tip_velocities[i, 1]
        work.tip_forces[i, 0] = law.jaw_stiffness * error_x + law.jaw_damping * rate_x
        work.tip_forces[i, 1] = law.jaw_stiffness * error_y + law.jaw_damping * rate_y
    return sine, cosine
