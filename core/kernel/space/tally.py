"""Sums over the rows of a run in space, from which its metrics follow."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled_apart
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.space.model import MODEL
from slipgrasp.core.kernel.space.rows import ROW
from slipgrasp.core.kernel.space.state import path_at
from slipgrasp.core.kernel.space.ways import least_margin
from slipgrasp.core.kernel.space.workspace import STICK, WORKSPACE

# Sums so far, and what the last row adds to the integrals (by the trapezoidal rule).
TALLY = np.dtype(
    [
        ("rows", np.int64),
        ("start", np.float64),  # time of the first row [s]
        ("time", np.float64),  # of the last row [s]
        ("error", np.float64, (6,)),  # of the last row [m, rad]
        ("effort_rate", np.float64),  # [N^2 m^2]
        ("slipping", np.int64),  # contacts that slip
        ("last_slip", np.float64),  # time of the last row with a slipping contact [s]
        ("slip_path", np.float64, (MAX_FINGERS,)),  # [m]
        ("peak_normal_force", np.float64, (MAX_FINGERS,)),  # [N]
        ("least_margin", np.float64, (MAX_FINGERS,)),  # in stick; inf if never [N]
        ("squared_error", np.float64, (6,)),  # integral
        ("effort", np.float64),  # integral of the squared torques [N^2 m^2 s]
        ("violations", np.int64),  # rows whose command leaves the estimated cones
        ("first_violation", np.float64),  # [s]
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def spatial_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row.

    The first row only assumes stick before the first selection: where a second row at the
    same time follows, the friction margin of the first does not count.
    """
    n, discrete = model.num_fingers, row.discrete
    if tally.rows == 0:
        tally.start = tally.time = row.time
    elif tally.rows == 1 and row.time == tally.start:
        for i in range(n):
            tally.least_margin[i] = np.inf
    half_step = 0.5 * (row.time - tally.time)
    effort_rate = 0.0
    tally.slipping = 0
    for i in range(n):
        tally.slip_path[i] = row.state.x[path_at(n, i)]
        if tally.rows == 0 or work.forces[i, 2] > tally.peak_normal_force[i]:
            tally.peak_normal_force[i] = work.forces[i, 2]
        if discrete.phases[i] == STICK:
            margin = least_margin(model, discrete, work, i)
            tally.least_margin[i] = min(tally.least_margin[i], margin)
        else:
            tally.slipping += 1
        for joint in range(3):
            effort_rate += square(discrete.torques[i, joint])
    for k in range(6):
        error = work.room.error[k]
        tally.squared_error[k] += half_step * (square(error) + square(tally.error[k]))
        tally.error[k] = error
    tally.effort += half_step * (effort_rate + tally.effort_rate)
    tally.effort_rate = effort_rate
    if tally.slipping > 0:
        tally.last_slip = row.time
    if discrete.violation > 0.0:
        if tally.violations == 0:
            tally.first_violation = row.time
        tally.violations += 1
    tally.time = row.time
    tally.rows += 1
