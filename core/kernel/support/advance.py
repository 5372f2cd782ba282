"""Phases, stops and the loop of a run of a body on a support."""

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
from slipgrasp.core.kernel.loop.output import (
    log_change,
    log_changes,
    pass_output_times,
    phases_changed,
)
from slipgrasp.core.kernel.loop.progress import FIRST_STEP
from slipgrasp.core.kernel.loop.status import CHATTERING, EVENT_STALL, RUNNING
from slipgrasp.core.kernel.support.flow import (
    load_size,
    set_derivative,
    sliding_speed,
    stored_energy,
    support_onset,
    support_plant,
)
from slipgrasp.core.kernel.support.model import MODEL
from slipgrasp.core.kernel.support.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    copy_discrete,
    emit,
    emit_due,
    follow_slip,
    leave_slip,
)
from slipgrasp.core.kernel.support.state import SLIP, STICK, SUPPLIED
from slipgrasp.core.kernel.support.steps import support_accept, support_emit_inside


@compiled
def _settle(model: Record, run: Record) -> None:
    """Selects the phase: a body at rest sticks if its load is inside the limit surface."""
    discrete, bound = run.discrete, model.truth.static_friction[0] * model.truth.normal_force
    discrete.phases[0] = SLIP
    if sliding_speed(model, run.step.start) == 0.0:
        if load_size(model) <= bound:
            discrete.phases[0] = STICK
        else:
            support_onset(model, discrete)


@compiled
def _restart(model: Record, run: Record) -> None:
    """Computes the first slope of the flow."""
    support_plant(model, run.discrete, run.step.start, run.work)
    set_derivative(model, run.step.start, run.step.slopes[0], run.work)


@compiled
def _finish_jump(model: Record, run: Record, outlet: Record) -> int:
    """Logs phase changes, writes the row after a jump and restarts the flow."""
    chatters = log_changes(model, run, outlet)
    leave_slip(model, run, outlet, 0)
    emit(model, run, outlet, run.discrete)
    pass_output_times(model, run)
    _restart(model, run)
    run.step_size = min(run.step_size, FIRST_STEP)
    return CHATTERING if chatters else RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def support_event(model: Record, run: Record, outlet: Record) -> int:
    """Handles a stop: the body sticks, or begins to slide in another direction."""
    run.concerned = 0
    count_stall(run)
    copy_discrete(model, run.discrete, run.old)
    emit(model, run, outlet, run.old)
    if run.stalls > MAX_STALLS:
        return EVENT_STALL
    _settle(model, run)
    if run.discrete.phases[0] == SLIP:
        log_change(run, outlet, 0, SLIP, STICK)
        run.old.phases[0] = STICK
        run.turns += 1
    return _finish_jump(model, run, outlet)


@compiled
def _begin_stretch(model: Record, run: Record, outlet: Record, first: int, _same_ticks: int) -> int:
    """Starts the run, or continues it after a timed change with new constants."""
    run.begun = 1
    if first == 0:
        book_energy(model, run, stored_energy, SUPPLIED)
    copy_discrete(model, run.discrete, run.old)
    _settle(model, run)
    if first == 1:
        if not phases_changed(model, run):
            _restart(model, run)
            return RUNNING
        # Every run is assumed to start in stick.
        emit(model, run, outlet, run.old)
    return _finish_jump(model, run, outlet)


@compiled
def _next_stop(_model: Record, _run: Record, t_stop: float) -> float:
    """Next known instant: the end of the segment."""
    return t_stop


@compiled
def _pass_instant(_model: Record, _run: Record, _outlet: Record, _t_stop: float) -> int:
    """There are no instants inside a segment."""
    return RUNNING


@compiled
def _cut(_model: Record, _run: Record, size: float) -> float:
    """A stop is already at the end of its step."""
    return size


@compiled
def _count_step(_model: Record, run: Record, _h: float) -> None:
    """Counts a step; nothing is integrated for the metrics."""
    run.tally.steps += 1


@compiled
def _finish_step(
    _model: Record, _run: Record, _outlet: Record, _t_stop: float, _reaches: bool
) -> int:
    """Nothing changes at the end of a step without a stop."""
    return RUNNING


@compiled
def _emit_end(model: Record, run: Record, outlet: Record, _t_stop: float) -> None:
    """Appends the row at the end of the segment."""
    emit(model, run, outlet, run.discrete)


advance, advance_run = make_advance(
    LAYOUTS,
    emit=emit,
    emit_end=_emit_end,
    emit_due=emit_due,
    begin=_begin_stretch,
    next_stop=_next_stop,
    pass_instant=_pass_instant,
    take_step=support_accept,
    cut=_cut,
    count_step=_count_step,
    emit_inside=support_emit_inside,
    follow_slip=follow_slip,
    leave_slip=leave_slip,
    pass_event=support_event,
    finish_step=_finish_step,
    pace_steps=50_000,
    least_pace=1e-9,
)
