"""The start of a stretch of a run in which nothing given changes."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.dynamics import stored_energy
from slipgrasp.core.kernel.flow import update_mechanics
from slipgrasp.core.kernel.jump import select_again
from slipgrasp.core.kernel.model import MODEL
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.run import OUTLET, PROGRESS, emit, keep_old
from slipgrasp.core.kernel.state import supplied_at
from slipgrasp.core.kernel.tick import control_tick, leave_ticks, next_tick, restart_ticks


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def begin_stretch(model: Record, run: Record, outlet: Record, first: int, same_ticks: int) -> int:
    """Starts the run, or goes on after a timed change under new constants.

    Args:
        model: Constants from now on.
        run: The run; at a later stretch the row before the change is already written.
        outlet: Buffers for rows and phase changes.
        first: 1 where the run starts here.
        same_ticks: 1 where sampled control keeps its ticks (its period did not change).
    """
    run.begun = 1
    if first == 0:
        _book_energy(model, run)
    if model.law.period == 0.0:
        leave_ticks(model, run)
    elif same_ticks == 0:
        restart_ticks(run)
        run.hold_until = np.inf
    if model.law.period > 0.0 and run.now >= next_tick(model, run):
        return control_tick(model, run, outlet, first, 1)
    if model.law.period == 0.0 and run.hold_until == np.inf:
        for i in range(model.num_fingers):
            run.discrete.beliefs[i] = run.discrete.phases[i]
    if first == 1:
        emit(model, run, outlet, run.now, run.step.start)
    keep_old(model, run)
    return select_again(model, run, outlet)


@compiled
def _book_energy(model: Record, run: Record) -> None:
    """Adds to the supplied energy what a timed change of mass or inertia brings in."""
    state = run.step.start
    update_mechanics(model, state, run.work)
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    before = run.row.kinetic_energy + run.row.potential_energy
    state.x[supplied_at(model)] += kinetic + potential - before
