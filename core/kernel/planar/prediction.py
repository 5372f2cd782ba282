"""State that the law predicts for the instant at which the current command takes effect.

With a latency, the torques until then are already commanded. The estimated model gives their
effect: M~^ x'' = B~^ tau - h~^ at the measured state, integrated once and twice over the latency.
Kinematics and phases are kept constant, and a predicted slip does not reverse.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.planar.inertia import solve
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.reduced import apply_tip_forces, assemble_bias, torques_to_forces
from slipgrasp.core.kernel.planar.state import STATE, count_coordinates, reduced_at, slip_coordinate
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE

# Predicted state, and the impulses it depends on.
PREDICTION = np.dtype(
    [
        ("impulses", np.float64, (2, MAX_FINGERS, 2)),  # torques integrated once, twice
        ("state", STATE),
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, PREDICTION)
def predict(
    model: Record, discrete: Record, state: Record, work: Record, prediction: Record
) -> None:
    """Writes the predicted state to ``prediction.state``.

    Args:
        model: Constants of the run; the prediction time is the latency.
        discrete: Discrete state, with the estimated phases.
        state: Measured state.
        work: Estimated model, evaluated at that state.
        prediction: With the impulses of the torques that act until then.
    """
    n, lead, ahead = model.num_fingers, model.law.latency, prediction.state
    for k in range(model.num_states):
        ahead.x[k] = state.x[k]
    for k in range(count_coordinates(n)):
        at, rate = reduced_at(n, k)
        ahead.x[at] += lead * state.x[rate]
    for order in range(2):
        _integrate(model, discrete, work, prediction, order)
        for k in range(count_coordinates(n)):
            at, rate = reduced_at(n, k)
            ahead.x[rate if order == 0 else at] += work.column[k]
    for i in range(n):
        at, rate = reduced_at(n, slip_coordinate(i))
        if discrete.beliefs[i] == 0 or ahead.x[rate] * discrete.beliefs[i] < 0.0:
            ahead.x[rate] = 0.0
            ahead.x[at] = state.x[at]


@compiled
def _integrate(
    model: Record, discrete: Record, work: Record, prediction: Record, order: int
) -> None:
    """Integrates x'' over the latency, once (order 0) or twice (order 1), in ``work.column``."""
    n, kin, lead = model.num_fingers, work.kin, model.law.latency
    span = lead if order == 0 else 0.5 * lead * lead
    torques_to_forces(kin, n, prediction.impulses[order], work.tip_forces)
    apply_tip_forces(kin, work.believed, discrete.beliefs, work.tip_forces, work.column)
    assemble_bias(
        kin, work.believed_dynamics, work.believed, model.hand.gravity, discrete.beliefs, work.bias
    )
    for k in range(count_coordinates(n)):
        work.column[k] -= span * work.bias[k]
    solve(work.estimated_factors, n, work.column)
