"""Events, jumps at known instants, and the loop of a run on a rail."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.advance import (
    MAX_STALLS,
    book_energy,
    count_stall,
    make_advance,
)
from slipgrasp.core.kernel.loop.guards import find_end
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.output import log_changes, pass_output_times
from slipgrasp.core.kernel.loop.progress import FIRST_STEP
from slipgrasp.core.kernel.loop.status import CHATTERING, EVENT_STALL, RUNNING, SEPARATED
from slipgrasp.core.kernel.loop.tally import count_forces
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.state import supplied_at
from slipgrasp.core.kernel.rail.flow import effort_rate, flow, rail_evaluate
from slipgrasp.core.kernel.rail.guards import PER_CONTACT, PHASE, arm_guards, speed_at
from slipgrasp.core.kernel.rail.model import MODEL, NUM_CONTACTS
from slipgrasp.core.kernel.rail.phases import opened_contact, rail_select
from slipgrasp.core.kernel.rail.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    copy_discrete,
    emit,
    emit_due,
    emit_or_end,
    follow_slip,
    leave_slip,
)
from slipgrasp.core.kernel.rail.steps import (
    rail_accept,
    rail_count,
    rail_cut,
    rail_emit_inside,
)

_JUMP = -1  # instead of the contacts whose phase ends


@compiled
def _restart(model: Record, run: Record) -> None:
    """Computes the first slope and arms the guards."""
    flow(model, run.discrete, run.now, run.step.start, run.step.slopes[0], run.work)
    run.step.efforts[0] = effort_rate(run.work)
    arm_guards(model, run.discrete, run.step.start, run.work, run.guards)
    count_forces(model, run.discrete, run.guards.starts, run.tally, PER_CONTACT, 1)
    run.step_size = min(run.step_size, FIRST_STEP)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64)
def rail_jump(model: Record, run: Record, outlet: Record, fired: int) -> int:
    """Selects phases, writes the row after the jump and restarts the flow.

    Args:
        model: Constants of the run.
        run: The run; the row before the jump is already written.
        outlet: Output buffers.
        fired: Bits of the contacts whose phase ends, or ``_JUMP``.
    """
    rail_evaluate(model, run.old, run.now, run.step.start, run.work)
    status = rail_select(model, run.discrete, run.old, run.step.start, run.work, fired)
    if status != RUNNING:
        run.concerned = opened_contact(model, run.step.start, run.work)
        return SEPARATED if run.concerned >= 0 else status
    chatters = log_changes(model, run, outlet)
    leave_slip(model, run, outlet, 0)
    emit(model, run, outlet, run.discrete)
    pass_output_times(model, run)
    _restart(model, run)
    return CHATTERING if chatters else RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def rail_event(model: Record, run: Record, outlet: Record) -> int:
    """Handles the guards that fired: end of the run or phase change."""
    count_stall(run)
    status = find_end(model, run, PER_CONTACT)
    if status == RUNNING and run.stalls > MAX_STALLS:
        status = EVENT_STALL
    fired = 0
    for i in range(NUM_CONTACTS):
        if run.guards.fired[PER_CONTACT * i + PHASE] == 1:
            fired |= 1 << i
            run.concerned = i
            if run.discrete.phases[i] != 0:
                run.step.start.x[speed_at(i)] = 0.0
    emit(model, run, outlet, run.discrete)
    if status != RUNNING:
        return status
    copy_discrete(model, run.discrete, run.old)
    return rail_jump(model, run, outlet, fired)


@compiled
def _next_stop(model: Record, run: Record, t_stop: float) -> float:
    """Next known instant: the end of a motion or of the segment."""
    return min(t_stop, model.motion.breaks[run.discrete.piece])


@compiled
def _pass_instant(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
    """Handles a jump of the desired motion."""
    if run.now >= t_stop:
        return RUNNING
    copy_discrete(model, run.discrete, run.old)
    emit(model, run, outlet, run.discrete)
    pass_breaks(model.motion, run.discrete, run.now)
    run.old.piece = run.discrete.piece
    return rail_jump(model, run, outlet, _JUMP)


@compiled
def _begin_stretch(model: Record, run: Record, outlet: Record, first: int, _same_ticks: int) -> int:
    """Starts the run, or continues it after a timed change with new constants."""
    run.begun = 1
    pass_breaks(model.motion, run.discrete, run.now)
    if first == 0:
        rail_evaluate(model, run.discrete, run.now, run.step.start, run.work)
        book_energy(model, run, stored_energy, supplied_at(model))
    else:
        emit(model, run, outlet, run.discrete)
    copy_discrete(model, run.discrete, run.old)
    return rail_jump(model, run, outlet, _JUMP)


@compiled
def _finish_step(model: Record, run: Record, outlet: Record, t_stop: float, reaches: bool) -> int:
    """Handles the jump at the end of a step that reaches a known instant."""
    return _pass_instant(model, run, outlet, t_stop) if reaches else RUNNING


@compiled
def _emit_end(model: Record, run: Record, outlet: Record, t_stop: float) -> None:
    """Appends the row at the end of the segment."""
    emit_or_end(model, run, outlet, run.discrete, t_stop, run.step.start, t_stop)


advance, advance_run = make_advance(
    LAYOUTS,
    emit=emit,
    emit_end=_emit_end,
    emit_due=emit_due,
    begin=_begin_stretch,
    next_stop=_next_stop,
    pass_instant=_pass_instant,
    take_step=rail_accept,
    cut=rail_cut,
    count_step=rail_count,
    emit_inside=rail_emit_inside,
    follow_slip=follow_slip,
    leave_slip=leave_slip,
    pass_event=rail_event,
    finish_step=_finish_step,
    pace_steps=5000,
    least_pace=1e-6,
)
