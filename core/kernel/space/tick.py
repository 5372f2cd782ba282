"""A tick of sampled control in space."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.jump import MODEL_SINGULAR, RUNNING
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.run import CLAMPED, phases_changed, warn
from slipgrasp.core.kernel.space.command import spatial_command
from slipgrasp.core.kernel.space.jump import (
    FREE_ROTATION,
    SOFTENED,
    finish_jump,
    forget_leaving,
    keep_old,
    restart,
    settle,
)
from slipgrasp.core.kernel.space.learning import spatial_learn
from slipgrasp.core.kernel.space.model import MODEL
from slipgrasp.core.kernel.space.run import (
    OUTLET,
    PROGRESS,
    copy_discrete,
    spatial_emit,
    store_tick,
)


@compiled
def _advance_estimates(model: Record, run: Record) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    elapsed, unknowns = run.now - run.last_tick, model.unknowns
    run.last_tick = run.now
    for k in range(model.num_unknowns):
        value = run.discrete.estimates[k] + elapsed * run.pending_rates[k]
        bounded = min(max(value, unknowns.minimum[k]), unknowns.maximum[k])
        if bounded != value:
            warn(run, CLAMPED)
        run.discrete.estimates[k] = bounded


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def spatial_tick(model: Record, run: Record, outlet: Record, first: int, stretch: int) -> int:
    """One tick of sampled control: new estimates, new torque, new selection, and what is learnt.

    Args:
        model: Constants of the run.
        run: The run.
        outlet: Buffers for rows and phase changes.
        first: 1 at the start of the run.
        stretch: 1 at the start of a stretch, which gives two rows.
    """
    discrete, work = run.discrete, run.work
    keep_old(model, run)
    _advance_estimates(model, run)
    run.ticks += 1
    regular = spatial_command(model, discrete, run.now, run.step.start, work)
    if regular == 0:
        spatial_emit(model, run, outlet, run.old)
        return MODEL_SINGULAR
    store_tick(model, run, outlet)
    if work.grasp.rank < 6:
        warn(run, FREE_ROTATION)
    if work.grasp.soft > 0:
        warn(run, SOFTENED)
    if first == 1:
        # The stick that every run assumes at its start, under the first torque.
        copy_discrete(model, discrete, run.old)
    forget_leaving(model, run)
    status = settle(model, run)
    if status == RUNNING:
        spatial_learn(model, discrete, run.step.start, work, run.memory)
        for k in range(model.num_unknowns):
            run.pending_rates[k] = work.rates[k]
    if status != RUNNING or stretch == 1 or phases_changed(model, run):
        # At the start of a later stretch the row before is written already.
        return finish_jump(model, run, outlet, status, stretch == 0 or first == 1)
    restart(model, run)
    return RUNNING
