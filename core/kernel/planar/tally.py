"""Accumulators of the metrics, part specific to planar runs."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.loop.tally import add_row, add_squared_error, tally_layout
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.guards import friction_margin
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.rows import ROW
from slipgrasp.core.kernel.planar.state import slip_at, velocity_at
from slipgrasp.core.kernel.planar.workspace import WORKSPACE

TALLY = tally_layout(3)


@compiled
def add_step(
    model: Record, discrete: Record, step: Record, t: float, h: float, tally: Record
) -> None:
    """Adds an accepted step of size ``h`` from time ``t`` to integrals and slip paths."""
    for i in range(model.num_fingers):
        tally.slip_path[i] += abs(step.end.x[slip_at(i)] - step.start.x[slip_at(i)])
    is_known = tally.steps > 0 and tally.piece == discrete.piece
    tally.steps, tally.piece = tally.steps + 1, discrete.piece
    for k in range(3):
        if not is_known:
            tally.end_error[k], tally.end_rate[k] = _error(model, discrete, t, step.start, k)
        error, rate = _error(model, discrete, t + h, step.end, k)
        add_squared_error(tally, k, h, error, rate)
    effort = 0.0
    if model.law.period > 0.0:
        for i in range(model.num_fingers):
            effort += square(discrete.torques[i, 0]) + square(discrete.torques[i, 1])
    else:
        method = method_of(model, step)
        for k in range(method.last):
            effort += method.matrix[method.last, k] * step.efforts[k]
    tally.effort += h * effort


@compiled
def _error(model: Record, discrete: Record, t: float, state: Record, k: int) -> tuple[float, float]:
    """Tracking error of coordinate ``k`` and its rate."""
    position, velocity, _ = desired_motion(model.motion, discrete.piece, t, k)
    return position - state.x[k], velocity - state.x[velocity_at(k)]


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def add_to_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row to the metrics."""
    add_row(model, row, work, tally, work.room.violation, friction_margin)
