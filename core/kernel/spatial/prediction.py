"""State that the law predicts for the instant at which the current command takes effect.

As for planar hands (`slipgrasp.core.kernel.planar.prediction`), the accelerations of the estimated
model at the measured state, under the torques already commanded, are integrated once and twice over
the latency. Kinematics and phases are kept constant, and a predicted slip does not reverse.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.spatial.kinematics import torques_to_forces
from slipgrasp.core.kernel.spatial.law import exponential, product
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.plant import solve_motion
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.state import (
    ATTITUDE,
    POSITION,
    SPIN,
    STATE,
    VELOCITY,
    rate_at,
    slip_at,
    slip_velocity_at,
)
from slipgrasp.core.kernel.spatial.ways import axes_of
from slipgrasp.core.kernel.spatial.workspace import WORKSPACE

# Predicted state, and the values it depends on.
PREDICTION = np.dtype(
    [
        ("impulses", np.float64, (2, MAX_FINGERS, 3)),  # torques integrated once, twice
        ("torques", np.float64, (MAX_FINGERS, 3)),  # their mean [N m]
        ("no_load", np.float64, (6,)),  # zero: laws do not know pulses
        ("turn", np.float64, (3,)),  # predicted rotation of the object [rad]
        ("state", STATE),
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, SENSES, WORKSPACE, PREDICTION)
def spatial_predict(model: Record, senses: Record, work: Record, prediction: Record) -> None:
    """Writes the predicted state to ``prediction.state``.

    Args:
        model: Constants of the run; the prediction time is the latency.
        senses: Measured state, and estimated slips.
        work: Estimated model, evaluated at that state.
        prediction: With the impulses of the torques that act until then.
    """
    n, lead, turn = model.num_fingers, model.law.latency, prediction.turn
    x, ahead = senses.measured.x, prediction.state.x
    for k in range(model.num_states):
        ahead[k] = x[k]
    for k in range(3):
        ahead[POSITION + k] += lead * x[VELOCITY + k]
        turn[k] = lead * x[SPIN + k]
    for i in range(n):
        for axis in range(2):
            ahead[slip_at(i, axis)] += lead * x[slip_velocity_at(n, i, axis)]
    _add_accelerations(model, senses, work, prediction, 0, lead)
    _add_accelerations(model, senses, work, prediction, 1, 0.5 * lead * lead)
    a = ATTITUDE
    attitude = product(
        exponential((turn[0], turn[1], turn[2])), (x[a], x[a + 1], x[a + 2], x[a + 3])
    )
    for k in range(4):
        ahead[ATTITUDE + k] = attitude[k]
    for i in range(n):
        for way in range(model.ways):
            _keep_from_turning_back(model, senses, prediction, i, way)


@compiled
def _add_accelerations(
    model: Record, senses: Record, work: Record, prediction: Record, order: int, span: float
) -> None:
    """Adds the accelerations under the mean torque to the rates, or to the positions and ``turn``.

    They are linear in the torque, so the mean torque gives their integral over the latency.
    """
    n, ahead, turn = model.num_fingers, prediction.state.x, prediction.turn
    for i in range(n):
        for joint in range(3):
            prediction.torques[i, joint] = prediction.impulses[order, i, joint] / span
    torques_to_forces(model.hand, work.kin, prediction.torques, work.tip_forces)
    solve_motion(
        model,
        senses.measured,
        work,
        work.believed_dynamics,
        work.believed_system,
        work.believed,
        prediction.no_load,
    )
    for k in range(6):
        gained = span * work.acceleration[k]
        if order == 0:
            ahead[rate_at(n, k)] += gained
        elif k < 3:
            ahead[POSITION + k] += gained
        else:
            turn[k - 3] += gained
    for i in range(n):
        for axis in range(2):
            at = slip_velocity_at(n, i, axis) if order == 0 else slip_at(i, axis)
            ahead[at] += span * work.slip_acceleration[i, axis]


@compiled
def _keep_from_turning_back(
    model: Record, senses: Record, prediction: Record, i: int, way: int
) -> None:
    """Sets the predicted slip of a mode to rest if it sticks or would reverse."""
    n, x, ahead, along = model.num_fingers, senses.measured.x, prediction.state.x, 0.0
    for axis in axes_of(model, way):
        along += senses.gamma[i, axis] * ahead[slip_velocity_at(n, i, axis)]
    if senses.slips[i, way] != 0.0 and along >= 0.0:
        return
    for axis in axes_of(model, way):
        ahead[slip_velocity_at(n, i, axis)] = 0.0
        ahead[slip_at(i, axis)] = x[slip_at(i, axis)]
