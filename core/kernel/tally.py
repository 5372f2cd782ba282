"""Figures of merit of a run, added up row by row, so that no trace need be kept for them."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.guards import friction_margin
from slipgrasp.core.kernel.model import MODEL
from slipgrasp.core.kernel.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.rows import ROW
from slipgrasp.core.kernel.state import slip_at
from slipgrasp.core.kernel.workspace import WORKSPACE

# Sums so far, and what the last row adds to the integrals (by the trapezoidal rule).
TALLY = np.dtype(
    [
        ("rows", np.int64),
        ("start", np.float64),  # time of the first row [s]
        ("time", np.float64),  # of the last row [s]
        ("slip", np.float64, (MAX_FINGERS,)),  # [m]
        ("error", np.float64, (3,)),  # of the last row [m, m, rad]
        ("effort_rate", np.float64),  # [N^2 m^2]
        ("slipping", np.int64),  # contacts that slip
        ("last_slip", np.float64),  # time of the last row with a slipping contact [s]
        ("slip_path", np.float64, (MAX_FINGERS,)),  # [m]
        ("peak_normal_force", np.float64, (MAX_FINGERS,)),  # [N]
        ("least_margin", np.float64, (MAX_FINGERS,)),  # in stick; inf if never [N]
        ("squared_error", np.float64, (3,)),  # integral
        ("effort", np.float64),  # integral of the squared torques [N^2 m^2 s]
        ("violations", np.int64),  # rows whose command leaves the estimated cones
        ("first_violation", np.float64),  # [s]
    ],
    align=True,
)


@compiled
def begin_tally(tally: Record) -> None:
    """Makes a tally of no row yet from one that is all zero."""
    tally.last_slip = -np.inf
    for i in range(MAX_FINGERS):
        tally.least_margin[i] = np.inf


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def add_to_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row.

    The first row only assumes stick before the first selection: where a second row at the
    same time follows, the friction margin of the first does not count.
    """
    n = model.num_fingers
    if tally.rows == 0:
        tally.start = tally.time = row.time
        for i in range(n):
            tally.slip[i] = row.state.x[slip_at(i)]
    elif tally.rows == 1 and row.time == tally.start:
        for i in range(n):
            tally.least_margin[i] = np.inf
    half_step = 0.5 * (row.time - tally.time)
    effort_rate = 0.0
    tally.slipping = 0
    for i in range(n):
        slip = row.state.x[slip_at(i)]
        tally.slip_path[i] += abs(slip - tally.slip[i])
        tally.slip[i] = slip
        if tally.rows == 0 or work.forces[i, 1] > tally.peak_normal_force[i]:
            tally.peak_normal_force[i] = work.forces[i, 1]
        if row.discrete.phases[i] == 0:
            margin = friction_margin(model, row.discrete, work, i)
            tally.least_margin[i] = min(tally.least_margin[i], margin)
        else:
            tally.slipping += 1
        effort_rate += square(row.torques[i, 0]) + square(row.torques[i, 1])
    for k in range(3):
        error = work.room.error[k]
        tally.squared_error[k] += half_step * (square(error) + square(tally.error[k]))
        tally.error[k] = error
    tally.effort += half_step * (effort_rate + tally.effort_rate)
    tally.effort_rate = effort_rate
    if tally.slipping > 0:
        tally.last_slip = row.time
    if work.room.violation > 0.0:
        if tally.violations == 0:
            tally.first_violation = row.time
        tally.violations += 1
    tally.time = row.time
    tally.rows += 1
