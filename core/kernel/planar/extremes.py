"""What an accepted step of a planar run adds to the metrics, the extremes inside it included."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.extreme_search import least_inside, nears_record
from slipgrasp.core.kernel.planar.dips import value_inside
from slipgrasp.core.kernel.planar.guards import NORMAL_FORCE, PER_CONTACT, PHASE, evaluate_ends
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import PROGRESS
from slipgrasp.core.kernel.planar.stepper import take_step
from slipgrasp.core.kernel.planar.tally import add_step, count_force, count_forces, count_margin

_LEAST = types.float64, types.int64, types.float64, types.float64, types.float64


@compiled_apart(types.float64, MODEL, PROGRESS, *_LEAST)
def find_extreme(
    model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
) -> float:
    """The least value of ``sign`` times guard ``j`` in the step; inf if it is no new extreme."""
    end = run.guards.ends[j]
    return least_inside(model, run, h, j, sign, start, end, record, value_inside)


@compiled
def _extreme_of(
    model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
) -> float:
    """The same where one is possible."""
    if not nears_record(model, run.step, j, sign, start, run.guards.ends[j], record):
        return np.inf
    return find_extreme(model, run, h, j, sign, start, record)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def count_step(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the present state on to the metrics.

    Where the law jumps at its end the forces there are those of neither side: those up to just
    before the jump count.
    """
    discrete, guards, step, work = run.discrete, run.guards, run.step, run.work
    add_step(model, discrete, step, run.now, h, run.tally)
    if run.fired == 1 and guards.fired[guards.count - 1] == 1:
        before = run.before_time - run.now
        if before > 0.0:
            take_step(model, discrete, run.now, before, step, work)
            evaluate_ends(model, discrete, step.end, work, guards)
            _count_extremes(model, run, before)
        take_step(model, discrete, run.now, h, step, work)
    else:
        _count_extremes(model, run, h)


@compiled
def _count_extremes(model: Record, run: Record, h: float) -> None:
    """Counts the forces in the step of size ``h`` and at its end."""
    discrete, tally = run.discrete, run.tally
    for i in range(model.num_fingers):
        base, peak = PER_CONTACT * i, tally.peak_normal_force[i]
        least = _extreme_of(model, run, h, base + NORMAL_FORCE, -1.0, tally.force[i], -peak)
        count_force(tally.peak_normal_force, i, -least)
        if discrete.phases[i] == 0:
            record = tally.least_margin[i]
            least = _extreme_of(model, run, h, base + PHASE, 1.0, tally.margin[i], record)
            count_margin(tally.least_margin, i, least)
    count_forces(model, discrete, run.guards.ends, tally)
