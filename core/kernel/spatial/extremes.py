"""What an accepted step of a spatial run adds to the metrics, the extremes inside it included."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.extreme_search import least_inside, nears_record
from slipgrasp.core.kernel.planar.tally import count_force, count_margin
from slipgrasp.core.kernel.spatial.dips import value_inside
from slipgrasp.core.kernel.spatial.guards import NORMAL_FORCE, PER_CONTACT, PHASE
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import PROGRESS
from slipgrasp.core.kernel.spatial.tally import add_step, count_forces
from slipgrasp.core.kernel.spatial.workspace import STICK

_LEAST = types.float64, types.int64, types.float64, types.float64, types.float64


@compiled_apart(types.float64, MODEL, PROGRESS, *_LEAST)
def spatial_extreme(
    model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
) -> float:
    """The least value of ``sign`` times guard ``j`` in the step; inf if it is no new extreme."""
    end = run.guards.values[j]
    return least_inside(model, run, h, j, sign, start, end, record, value_inside)


@compiled
def _extreme_of(
    model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
) -> float:
    """The same where one is possible."""
    if not nears_record(model, run.step, j, sign, start, run.guards.values[j], record):
        return np.inf
    return spatial_extreme(model, run, h, j, sign, start, record)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def spatial_count(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the present state on, cut at its event, to the metrics."""
    discrete, tally = run.discrete, run.tally
    add_step(model, discrete, run.step, run.work, tally, run.now, h)
    for i in range(model.num_fingers):
        base, peak = PER_CONTACT * i, tally.peak_normal_force[i]
        least = _extreme_of(model, run, h, base + NORMAL_FORCE, -1.0, tally.force[i], -peak)
        count_force(tally.peak_normal_force, i, -least)
        if discrete.phases[i] == STICK:
            for way in range(model.ways):
                record, start = tally.least_margin[i], tally.margins[i, way]
                least = _extreme_of(model, run, h, base + PHASE + way, 1.0, start, record)
                count_margin(tally.least_margin, i, least)
    count_forces(model, discrete, run.guards.values, tally)
