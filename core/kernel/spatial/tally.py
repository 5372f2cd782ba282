"""Accumulators of the metrics, part specific to spatial runs."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.tally import add_row, add_squared_error, tally_layout
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.law import update_object_errors
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.rows import ROW
from slipgrasp.core.kernel.spatial.state import path_at, spin_at, turned_at
from slipgrasp.core.kernel.spatial.ways import least_margin
from slipgrasp.core.kernel.spatial.workspace import WORKSPACE

TALLY = tally_layout(
    6,
    [
        ("spin_path", np.float64, (MAX_FINGERS,)),  # of soft contacts [rad]
        ("spin_end", np.float64, (MAX_FINGERS,)),  # spin in the last row [rad]
    ],
)


@compiled
def _add_errors(
    model: Record, t: float, h: float, state: Record, work: Record, tally: Record
) -> None:
    """Adds the squared errors of a step of size ``h`` that ends at time ``t``."""
    room = work.room
    pass_breaks(model.motion, tally, t)
    update_object_errors(model, tally.piece, t, state, room)
    for k in range(6):
        add_squared_error(tally, k, h, room.error[k], room.error_rate[k])


@compiled
def add_step(
    model: Record, discrete: Record, step: Record, work: Record, tally: Record, t: float, h: float
) -> None:
    """Adds an accepted step of size ``h`` from time ``t`` to the integrals."""
    if tally.steps == 0:
        _add_errors(model, t, 0.0, step.start, work, tally)
    tally.steps += 1
    _add_errors(model, t + h, h, step.end, work, tally)
    effort = 0.0
    for i in range(model.num_fingers):
        for joint in range(3):
            effort += square(discrete.torques[i, joint])
    tally.effort += h * effort


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def spatial_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row to the metrics."""
    for i in range(model.num_fingers):
        tally.slip_path[i] = row.state.x[path_at(model.num_fingers, i)]
        if model.soft == 1:
            tally.spin_path[i] = row.state.x[turned_at(model.num_fingers, i)]
            tally.spin_end[i] = row.state.x[spin_at(model.num_fingers, i)]
    add_row(model, row, work, tally, row.discrete.violation, least_margin)
