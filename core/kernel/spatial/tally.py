"""Accumulators of the metrics of a spatial run (see `slipgrasp.core.kernel.planar.tally`).

Forces count at both ends of every accepted step and at their extremes inside it, those of rows
apart; integrals are summed over the accepted steps.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.planar.tally import count_force, count_margin, integral_of_square
from slipgrasp.core.kernel.spatial.guards import NORMAL_FORCE, PER_CONTACT, PHASE
from slipgrasp.core.kernel.spatial.law import update_object_errors
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.rows import ROW
from slipgrasp.core.kernel.spatial.state import path_at
from slipgrasp.core.kernel.spatial.ways import least_margin
from slipgrasp.core.kernel.spatial.workspace import STICK, WORKSPACE

TALLY = np.dtype(
    [
        ("rows", np.int64),
        ("start", np.float64),  # time of the first row [s]
        ("time", np.float64),  # of the last row [s]
        ("error", np.float64, (6,)),  # of the last row [m, rad]
        ("slipping", np.int64),  # contacts that slip in the last row
        ("last_slip", np.float64),  # time of the last row with a slipping contact [s]
        ("slip_path", np.float64, (MAX_FINGERS,)),  # [m]
        ("force", np.float64, (MAX_FINGERS,)),  # normal, where the next step starts [N]
        ("margins", np.float64, (MAX_FINGERS, 2)),  # of friction in stick, there [N]
        ("peak_normal_force", np.float64, (MAX_FINGERS,)),  # [N]
        ("least_margin", np.float64, (MAX_FINGERS,)),  # in stick; inf if never [N]
        ("row_peak", np.float64, (MAX_FINGERS,)),  # the same of rows [N]
        ("row_margin", np.float64, (MAX_FINGERS,)),  # [N]
        ("steps", np.int64),
        ("piece", np.int64),  # of the desired motion at its end
        ("end_error", np.float64, (6,)),  # of the object there [m, rad]
        ("end_rate", np.float64, (6,)),  # [m/s, rad/s]
        ("squared_error", np.float64, (6,)),  # integral
        ("effort", np.float64),  # integral of the squared torques [N^2 m^2 s]
        ("violations", np.int64),  # rows whose command leaves the estimated cones
        ("first_violation", np.float64),  # [s]
    ],
    align=True,
)


@compiled
def count_forces(model: Record, discrete: Record, values: Floats, tally: Record) -> None:
    """Counts the contact forces of a state from which the next step starts.

    Args:
        model: Constants of the run.
        discrete: Phases.
        values: Of the guards at that state.
        tally: The accumulators.
    """
    for i in range(model.num_fingers):
        base = PER_CONTACT * i
        tally.force[i] = values[base + NORMAL_FORCE]
        count_force(tally.peak_normal_force, i, tally.force[i])
        if discrete.phases[i] == STICK:
            for way in range(model.ways):
                tally.margins[i, way] = values[base + PHASE + way]
                count_margin(tally.least_margin, i, tally.margins[i, way])


@compiled
def count_row_forces(model: Record, discrete: Record, work: Record, tally: Record) -> None:
    """Counts the contact forces of an evaluated row."""
    for i in range(model.num_fingers):
        count_force(tally.row_peak, i, work.forces[i, 2])
        if discrete.phases[i] == STICK:
            count_margin(tally.row_margin, i, least_margin(model, discrete, work, i))


@compiled
def _add_errors(
    model: Record, t: float, h: float, state: Record, work: Record, tally: Record
) -> None:
    """Adds the squared errors of a step of size ``h`` that ends in a state at ``t``."""
    room, before, slope = work.room, tally.end_error, tally.end_rate
    pass_breaks(model.motion, tally, t)
    update_object_errors(model, tally.piece, t, state, room)
    for k in range(6):
        error, rate = room.error[k], room.error_rate[k]
        tally.squared_error[k] += integral_of_square(h, before[k], slope[k], error, rate)
        before[k], slope[k] = error, rate


@compiled
def add_step(
    model: Record, discrete: Record, step: Record, work: Record, tally: Record, t: float, h: float
) -> None:
    """Adds an accepted step of size ``h`` from ``t`` on to the integrals."""
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
    """Adds an evaluated row.

    The first row only assumes stick before the first selection: where a second row at the
    same time follows, the friction margin of the first does not count.
    """
    n, discrete = model.num_fingers, row.discrete
    if tally.rows == 0:
        tally.start = row.time
    elif tally.rows == 1 and row.time == tally.start:
        for i in range(n):
            tally.row_margin[i] = np.inf
    count_row_forces(model, discrete, work, tally)
    tally.slipping = 0
    for i in range(n):
        tally.slip_path[i] = row.state.x[path_at(n, i)]
        if discrete.phases[i] != STICK:
            tally.slipping += 1
    for k in range(6):
        tally.error[k] = work.room.error[k]
    if tally.slipping > 0:
        tally.last_slip = row.time
    if discrete.violation > 0.0:
        if tally.violations == 0:
            tally.first_violation = row.time
        tally.violations += 1
    tally.time = row.time
    tally.rows += 1
