"""Events inside a step of a spatial run, and extremes of the forces."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.dip_search import make_dip_of
from slipgrasp.core.kernel.loop.extreme_search import make_count_extremes
from slipgrasp.core.kernel.loop.guards import NEAR_SINGULAR
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.guards import (
    FACE,
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
    SINGULAR,
    band_of,
    limit_at,
    sample_guards,
)
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import LAYOUTS, PROGRESS
from slipgrasp.core.kernel.spatial.stepper import state_inside
from slipgrasp.core.kernel.spatial.tally import add_step
from slipgrasp.core.kernel.spatial.torsion import begins_slip
from slipgrasp.core.kernel.spatial.workspace import STICK


@compiled
def value_inside(model: Record, run: Record, h: float, j: int, share: float) -> float:
    """Value of guard ``j`` at the fraction ``share`` of the step; the step is not changed."""
    step, state, work = run.step, run.selection.probe, run.slip.work
    state_inside(model, step, h, share, state)
    spatial_plant(model, run.discrete, state, work)
    row = method_of(model, step).last + 1  # unused by the stages of the step
    sample_guards(model, run.discrete, state, work, step.samples, row)
    return step.samples[row, j]


_, _dip_of = make_dip_of(LAYOUTS, band_of, value_inside)


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def spatial_dip(model: Record, run: Record, h: float) -> float:
    """Time within a step of size ``h`` at which a guard is past its level; 0 if never [s].

    At the end of the step no guard is past its level, or an event has been located there; an
    earlier event may still lie inside. In stick, a fingertip keeps its position on its face, its
    force reaches the cone before the normal force reaches zero, and the determinant stays positive.
    The short steps at the onset of a soft slip have one friction each.
    """
    guards, phases, found, slips = run.guards, run.discrete.phases, 0.0, False
    if begins_slip(model, run.discrete):
        return 0.0
    for i in range(model.num_fingers):
        base = PER_CONTACT * i
        for way in range(model.ways):
            found = max(found, _dip_of(model, run, h, base + PHASE + way))
        if phases[i] != STICK:
            slips = True
            found = max(found, _dip_of(model, run, h, base + NORMAL_FORCE))
            found = max(found, _dip_of(model, run, h, base + FACE))
        if min(guards.starts[base + SINGULAR], guards.ends[base + SINGULAR]) < NEAR_SINGULAR:
            found = max(found, _dip_of(model, run, h, base + SINGULAR))
        if model.hand.has_limits == 1:
            found = max(found, _dip_of(model, run, h, limit_at(model.num_fingers, i)))
    if slips:
        found = max(found, _dip_of(model, run, h, PER_CONTACT * model.num_fingers))
    return found * h


@compiled
def _count_ways(model: Record) -> int:
    """Number of slip modes of a contact."""
    return model.ways


_count_extremes = make_count_extremes(LAYOUTS, PER_CONTACT, _count_ways, value_inside)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def spatial_count(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the current state, up to its event, to the metrics."""
    add_step(model, run.discrete, run.step, run.work, run.tally, run.now, h)
    _count_extremes(model, run, h)
