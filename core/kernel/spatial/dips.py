"""Guards of a spatial hand that sink below their level and recover within one step."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.dip_search import comes_near, search_step
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
    sample_guards,
)
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import PROGRESS
from slipgrasp.core.kernel.spatial.stepper import state_inside
from slipgrasp.core.kernel.spatial.workspace import STICK


@compiled
def value_inside(model: Record, run: Record, h: float, j: int, share: float) -> float:
    """Value of guard ``j`` at a share of the step; all else is left as it is."""
    step, state, work = run.step, run.selection.probe, run.slip.work
    state_inside(model, step, h, share, state)
    spatial_plant(model, run.discrete, state, work)
    row = method_of(model, step).last + 1  # no slope of the step is sampled there
    sample_guards(model, run.discrete, state, work, step.samples, row)
    return step.samples[row, j]


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64, types.int64)
def _spatial_least(model: Record, run: Record, h: float, j: int) -> float:
    """The share of the step at which guard ``j`` is past its level; 0 if it is nowhere."""
    noise, _ = band_of(model, run.discrete, run.guards.ends, j)
    return search_step(model, run, h, j, noise, value_inside)


@compiled
def _dip_of(model: Record, run: Record, h: float, j: int) -> float:
    guards = run.guards
    if not comes_near(model, run.step, j, guards.starts[j], guards.ends[j], guards.levels[j]):
        return 0.0
    return _spatial_least(model, run, h, j)


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def spatial_dip(model: Record, run: Record, h: float) -> float:
    """When, in a step of size ``h`` just taken, a guard is past its level; 0 if none is [s].

    At the end no guard is past its level, or the event has been located there; the first of its
    falls may still lie before. In stick a fingertip keeps its place on its face, a normal force
    does not fall to zero before its cone is reached, and the determinant stays positive.
    """
    guards, phases, found, slips = run.guards, run.discrete.phases, 0.0, False
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
    if slips:
        found = max(found, _dip_of(model, run, h, PER_CONTACT * model.num_fingers))
    return found * h
