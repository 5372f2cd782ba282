"""Accumulators of the metrics of a run, so that metrics need no trace.

Forces are evaluated at both ends of every accepted step and at their extremes inside it
(`slipgrasp.core.kernel.loop.extreme_search`); integrals are sums over the accepted steps. Forces of
rows are accumulated separately, so that output times do not influence the search for extremes.
Rows exceed these extremes only within the accuracy of the search.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Layout, Record


def tally_layout(num_coordinates: int, more: Sequence[tuple[Any, ...]] = ()) -> Layout:
    """Layout of the accumulators; ``more`` are additional fields."""
    errors = (num_coordinates,)
    fields = [
        ("rows", np.int64),
        ("start", np.float64),  # time of the first row [s]
        ("time", np.float64),  # of the last row [s]
        ("error", np.float64, errors),  # of the last row [m, rad]
        ("slipping", np.int64),  # contacts that slip in the last row
        ("last_slip", np.float64),  # time of the last row with a slipping contact [s]
        ("slip_path", np.float64, (MAX_FINGERS,)),  # [m]
        ("force", np.float64, (MAX_FINGERS,)),  # normal, at the start of the next step [N]
        ("margins", np.float64, (MAX_FINGERS, 2)),  # friction margins in stick, likewise [N]
        ("peak_normal_force", np.float64, (MAX_FINGERS,)),  # [N]
        ("least_margin", np.float64, (MAX_FINGERS,)),  # in stick; inf if never [N]
        ("row_peak", np.float64, (MAX_FINGERS,)),  # the same for rows [N]
        ("row_margin", np.float64, (MAX_FINGERS,)),  # [N]
        ("steps", np.int64),
        ("piece", np.int64),  # of the desired motion in the last step
        ("end_error", np.float64, errors),  # at its end [m, rad]
        ("end_rate", np.float64, errors),  # [m/s, rad/s]
        ("squared_error", np.float64, errors),  # integral
        ("effort", np.float64),  # integral of the squared torques [N^2 m^2 s]
        ("violations", np.int64),  # rows in which the command violates the estimated limits
        ("first_violation", np.float64),  # [s]
        *more,
    ]
    return np.dtype(fields, align=True)


@compiled
def begin_tally(tally: Record) -> None:
    """Initializes accumulators from an all-zero record."""
    tally.last_slip = -np.inf
    for i in range(MAX_FINGERS):
        tally.least_margin[i] = tally.row_margin[i] = np.inf


@compiled
def count_force(peaks: Floats, i: int, force: float) -> None:
    """Accumulates a normal force of contact ``i`` [N]."""
    if peaks[i] < force < np.inf:
        peaks[i] = force


@compiled
def count_margin(least: Floats, i: int, margin: float) -> None:
    """Accumulates a friction margin of contact ``i`` in stick [N]."""
    if -np.inf < margin < least[i]:
        least[i] = margin


@compiled
def count_forces(
    model: Record, discrete: Record, values: Floats, tally: Record, per_contact: int, ways: int
) -> None:
    """Accumulates the contact forces of a state at the start of the next step.

    Args:
        model: Constants of the run.
        discrete: Phases.
        values: Values of the guards at that state.
        tally: The accumulators.
        per_contact: Number of guards per contact, of which the phase guards are first.
        ways: Number of phase guards.
    """
    for i in range(model.num_fingers):
        base = per_contact * i
        tally.force[i] = values[base + per_contact - 3]
        count_force(tally.peak_normal_force, i, tally.force[i])
        if discrete.phases[i] == 0:
            for way in range(ways):
                tally.margins[i, way] = values[base + way]
                count_margin(tally.least_margin, i, tally.margins[i, way])


@compiled
def count_row_forces(
    model: Record, row: Record, work: Record, tally: Record, friction_margin: Any
) -> None:
    """Accumulates the contact forces of an evaluated row."""
    normal = work.forces.shape[1] - 1
    for i in range(model.num_fingers):
        count_force(tally.row_peak, i, work.forces[i, normal])
        if row.discrete.phases[i] == 0:
            margin = friction_margin(model, row.discrete, work, i)
            count_margin(tally.row_margin, i, margin)


@compiled
def add_squared_error(tally: Record, k: int, h: float, error: float, rate: float) -> None:
    """Adds a step of size ``h`` to the integral of the squared error of coordinate ``k``.

    The error is interpolated by a cubic; the values at the end are stored for the next step.
    """
    e0, r0 = tally.end_error[k], tally.end_rate[k]
    tally.end_error[k], tally.end_rate[k] = error, rate
    tally.squared_error[k] += _integral_of_square(h, e0, r0, error, rate)


@compiled
def _integral_of_square(h: float, e0: float, r0: float, e1: float, r1: float) -> float:
    """Integral over ``h`` of the square of the cubic with these values and rates at its ends."""
    a, b = h * r0, h * r1
    total = 156.0 * (e0 * e0 + e1 * e1) + 108.0 * e0 * e1 + 44.0 * (e0 * a - e1 * b)
    total += 26.0 * (e1 * a - e0 * b) + 4.0 * (a * a + b * b) - 6.0 * a * b
    return h / 420.0 * total


@compiled
def add_row(
    model: Record,
    row: Record,
    work: Record,
    tally: Record,
    violation: float,
    friction_margin: Any,
) -> None:
    """Accumulates an evaluated row.

    The first row assumes stick because no phases have been selected yet: if a second row at the
    same time follows, the friction margin of the first is ignored.
    """
    n = model.num_fingers
    if tally.rows == 0:
        tally.start = row.time
    elif tally.rows == 1 and row.time == tally.start:
        for i in range(n):
            tally.row_margin[i] = np.inf
    count_row_forces(model, row, work, tally, friction_margin)
    tally.slipping = 0
    for i in range(n):
        if row.discrete.phases[i] != 0:
            tally.slipping += 1
    for k in range(len(tally.error)):
        tally.error[k] = work.room.error[k]
    if tally.slipping > 0:
        tally.last_slip = row.time
    if violation > 0.0:
        if tally.violations == 0:
            tally.first_violation = row.time
        tally.violations += 1
    tally.time = row.time
    tally.rows += 1
