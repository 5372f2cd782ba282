"""Accumulators of the metrics of a planar run, so that no trace need be kept for them.

Forces count at both ends of every accepted step and at their extremes inside it
(`slipgrasp.core.kernel.planar.extremes`); integrals and slip paths are summed over the accepted
steps. The forces of rows count apart, so that output times have no part in where extremes are
searched for: rows exceed these by no more than the accuracy with which they are located.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.motion import desired_motion
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.guards import NORMAL_FORCE, PER_CONTACT, PHASE, friction_margin
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.rows import ROW
from slipgrasp.core.kernel.planar.state import slip_at, velocity_at
from slipgrasp.core.kernel.planar.workspace import WORKSPACE

TALLY = np.dtype(
    [
        ("rows", np.int64),
        ("start", np.float64),  # time of the first row [s]
        ("time", np.float64),  # of the last row [s]
        ("error", np.float64, (3,)),  # of the last row [m, m, rad]
        ("slipping", np.int64),  # contacts that slip in the last row
        ("last_slip", np.float64),  # time of the last row with a slipping contact [s]
        ("slip_path", np.float64, (MAX_FINGERS,)),  # [m]
        ("force", np.float64, (MAX_FINGERS,)),  # normal, where the next step starts [N]
        ("margin", np.float64, (MAX_FINGERS,)),  # of friction in stick, there [N]
        ("peak_normal_force", np.float64, (MAX_FINGERS,)),  # [N]
        ("least_margin", np.float64, (MAX_FINGERS,)),  # in stick; inf if never [N]
        ("row_peak", np.float64, (MAX_FINGERS,)),  # the same of rows [N]
        ("row_margin", np.float64, (MAX_FINGERS,)),  # [N]
        ("steps", np.int64),
        ("piece", np.int64),  # of the desired motion in the last step
        ("end_error", np.float64, (3,)),  # at its end [m, rad]
        ("end_rate", np.float64, (3,)),  # [m/s, rad/s]
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
        tally.least_margin[i] = tally.row_margin[i] = np.inf


@compiled
def count_force(peaks: Floats, i: int, force: float) -> None:
    """Counts a normal force of contact ``i`` [N]."""
    if peaks[i] < force < np.inf:
        peaks[i] = force


@compiled
def count_margin(least: Floats, i: int, margin: float) -> None:
    """Counts a friction margin of contact ``i`` in stick [N]."""
    if -np.inf < margin < least[i]:
        least[i] = margin


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
        if discrete.phases[i] == 0:
            tally.margin[i] = values[base + PHASE]
            count_margin(tally.least_margin, i, tally.margin[i])


@compiled
def count_row_forces(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Counts the contact forces of an evaluated row."""
    for i in range(model.num_fingers):
        count_force(tally.row_peak, i, work.forces[i, 1])
        if row.discrete.phases[i] == 0:
            margin = friction_margin(model, row.discrete, work, i)
            count_margin(tally.row_margin, i, margin)


@compiled
def add_step(
    model: Record, discrete: Record, step: Record, t: float, h: float, tally: Record
) -> None:
    """Adds an accepted step of size ``h`` from ``t`` on to integrals and slip paths."""
    for i in range(model.num_fingers):
        tally.slip_path[i] += abs(step.end.x[slip_at(i)] - step.start.x[slip_at(i)])
    is_known = tally.steps > 0 and tally.piece == discrete.piece
    tally.steps, tally.piece = tally.steps + 1, discrete.piece
    for k in range(3):
        e0, r0 = tally.end_error[k], tally.end_rate[k]
        if not is_known:
            e0, r0 = _error(model, discrete, t, step.start, k)
        e1, r1 = _error(model, discrete, t + h, step.end, k)
        tally.end_error[k], tally.end_rate[k] = e1, r1
        tally.squared_error[k] += integral_of_square(h, e0, r0, e1, r1)
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
    """Tracking error of coordinate ``k``, and its rate."""
    position, velocity, _ = desired_motion(model.motion, discrete.piece, t, k)
    return position - state.x[k], velocity - state.x[velocity_at(k)]


@compiled
def integral_of_square(h: float, e0: float, r0: float, e1: float, r1: float) -> float:
    """Integral over ``h`` of the square of the cubic with these values and rates at its ends."""
    a, b = h * r0, h * r1
    total = 156.0 * (e0 * e0 + e1 * e1) + 108.0 * e0 * e1 + 44.0 * (e0 * a - e1 * b)
    total += 26.0 * (e1 * a - e0 * b) + 4.0 * (a * a + b * b) - 6.0 * a * b
    return h / 420.0 * total


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def add_to_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row.

    The first row only assumes stick before the first selection: where a second row at the
    same time follows, the friction margin of the first does not count.
    """
    n = model.num_fingers
    if tally.rows == 0:
        tally.start = row.time
    elif tally.rows == 1 and row.time == tally.start:
        for i in range(n):
            tally.row_margin[i] = np.inf
    count_row_forces(model, row, work, tally)
    tally.slipping = 0
    for i in range(n):
        if row.discrete.phases[i] != 0:
            tally.slipping += 1
    for k in range(3):
        tally.error[k] = work.room.error[k]
    if tally.slipping > 0:
        tally.last_slip = row.time
    if work.room.violation > 0.0:
        if tally.violations == 0:
            tally.first_violation = row.time
        tally.violations += 1
    tally.time = row.time
    tally.rows += 1
