"""Rows inside a slip of a hand in space (`slipgrasp.core.kernel.planar.slip_rows`)."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.tally import count_row_forces
from slipgrasp.core.kernel.planar.slip_rows import follow, leave
from slipgrasp.core.kernel.spatial.guards import is_past_event
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.rows import AT, column_of, spatial_evaluate, spatial_fill
from slipgrasp.core.kernel.spatial.run import OUTLET, PROGRESS, copy_discrete
from slipgrasp.core.kernel.spatial.stepper import state_inside
from slipgrasp.core.kernel.spatial.ways import least_margin


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64)
def spatial_follow_slip(model: Record, run: Record, outlet: Record, h: float) -> None:
    """Keeps states inside the step just taken while a contact is in the beginning of its slip."""
    follow(model, run, outlet, h, _sample, copy_discrete)


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.int64)
def spatial_leave_slip(model: Record, run: Record, outlet: Record, at_end: int) -> None:
    """Writes the rows that a slip lacks: where a phase has changed, or the stretch ends."""
    lost = column_of(model, AT.dissipated_energy)
    leave(model, run, outlet, at_end, lost, _evaluate, copy_discrete)


@compiled
def _sample(model: Record, run: Record, h: float, fraction: float, state: Record) -> None:
    """The state inside the step just taken."""
    state_inside(model, run.step, h, fraction, state)


@compiled
def _evaluate(model: Record, run: Record, row: Record) -> int:
    """Fills a row for the state in it; 0 where that is not finite, or past an event."""
    work = run.slip.work
    if spatial_evaluate(model, row, work) == 0:
        return 0
    if is_past_event(model, row.discrete, row.state, work, run.guards) == 1:
        return 0
    spatial_fill(model, row, work)
    count_row_forces(model, row, work, run.tally, least_margin)
    return 1
