"""What accepted steps add to the extremes of forces, those inside a step included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.extreme_search import least_inside, nears_record
from slipgrasp.core.kernel.loop.progress import Layouts
from slipgrasp.core.kernel.loop.tally import count_force, count_forces, count_margin


def make_count_extremes(
    layouts: Layouts, per_contact: int, count_ways: Any, value_inside: Any
) -> Any:
    """How a mechanics counts the forces of a step.

    Args:
        layouts: Its records.
        per_contact: Number of guards of a contact.
        count_ways: How many of these are of phases, for a model.
        value_inside: Value of a guard at a share of the step.
    """

    @compiled_apart(
        types.float64,
        *(layouts.model, layouts.progress, types.float64, types.int64),
        *(types.float64, types.float64, types.float64),
        prefix=layouts.prefix,
    )
    def find_extreme(
        model: Record, run: Record, h: float, j: int, sign: float, start: float, record: float
    ) -> float:
        """The least value of ``sign`` times guard ``j`` in the step; inf if it is no extreme."""
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

    @compiled
    def count_extremes(model: Record, run: Record, h: float) -> None:
        """Counts the forces in the step of size ``h`` and at its end."""
        discrete, tally = run.discrete, run.tally
        for i in range(model.num_fingers):
            base, peak = per_contact * i, tally.peak_normal_force[i]
            normal = base + per_contact - 3
            least = _extreme_of(model, run, h, normal, -1.0, tally.force[i], -peak)
            count_force(tally.peak_normal_force, i, -least)
            if discrete.phases[i] == 0:
                for way in range(count_ways(model)):
                    record, start = tally.least_margin[i], tally.margins[i, way]
                    least = _extreme_of(model, run, h, base + way, 1.0, start, record)
                    count_margin(tally.least_margin, i, least)
        count_forces(model, discrete, run.guards.ends, tally, per_contact, count_ways(model))

    return count_extremes
