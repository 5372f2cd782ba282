"""What an accepted step of a spatial run adds to the metrics, the extremes inside it included."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.extremes import make_count_extremes
from slipgrasp.core.kernel.spatial.dips import value_inside
from slipgrasp.core.kernel.spatial.guards import PER_CONTACT
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import LAYOUTS, PROGRESS
from slipgrasp.core.kernel.spatial.tally import add_step


@compiled
def _count_ways(model: Record) -> int:
    """In how many ways a contact slips."""
    return model.ways


_count_extremes = make_count_extremes(LAYOUTS, PER_CONTACT, _count_ways, value_inside)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def spatial_count(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the present state on, cut at its event, to the metrics."""
    add_step(model, run.discrete, run.step, run.work, run.tally, run.now, h)
    _count_extremes(model, run, h)
