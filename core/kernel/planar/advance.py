"""Events, jumps at known instants, and the loop of a planar run."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED
from slipgrasp.core.kernel.loop.advance import (
    MAX_STALLS,
    book_energy,
    count_stall,
    make_advance,
)
from slipgrasp.core.kernel.loop.guards import find_end
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.status import (
    EVENT_STALL,
    JOINT_LIMIT,
    LEFT_FACE,
    RUNNING,
    SINGULAR,
    UNBOUNDED_FORCE,
)
from slipgrasp.core.kernel.loop.ticks import next_command, next_tick, restart_ticks
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.flow import forget_mechanics, update_mechanics
from slipgrasp.core.kernel.planar.guards import NORMAL_FORCE, PER_CONTACT, PHASE
from slipgrasp.core.kernel.planar.interior import count_step
from slipgrasp.core.kernel.planar.jump import (
    consume_events,
    recognise,
    restart_flow,
    select_again,
)
from slipgrasp.core.kernel.planar.kinematics import is_at_limit
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    emit,
    emit_before_jump,
    emit_due,
    emit_or_end,
    evaluate_at,
    follow_slip,
    keep_old,
    leave_slip,
)
from slipgrasp.core.kernel.planar.state import supplied_at
from slipgrasp.core.kernel.planar.steps import (
    cut_at_event,
    emit_inside,
    take_accepted_step,
)
from slipgrasp.core.kernel.planar.tick import (
    apply_command,
    control_tick,
    leave_ticks,
)

# A normal force that is this many times larger before a jump of the law than after is unbounded.
POLE_RATIO = 1e3


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def pass_event(model: Record, run: Record, outlet: Record) -> int:
    """Handles the guards that fired: end of the run, phase change, or estimate at a bound.

    LEFT_FACE ends the segment; the run continues if the face continues with different friction.
    """
    count_stall(run)
    law_jumps = run.guards.fired[run.guards.count - 1] == 1
    if law_jumps:
        _keep_what_no_force_decides(model, run)
    status = find_end(model, run, PER_CONTACT)
    if status == SINGULAR:
        update_mechanics(model, run.step.start, run.work)
        if is_at_limit(model.hand, run.work.kin, run.concerned):
            status = JOINT_LIMIT
    if status in (RUNNING, LEFT_FACE) and run.stalls > MAX_STALLS:
        status = EVENT_STALL
    consume_events(model, run)
    if status != RUNNING:
        emit(model, run, outlet, run.discrete)
        return status
    if not (law_jumps or _phase_ends(model, run)):
        restart_flow(model, run)
        return RUNNING
    keep_old(model, run)
    if law_jumps:
        emit_before_jump(model, run, outlet)
        before = _largest_force(model, run)
        evaluate_at(model, run, run.discrete, run.now, run.step.start)
        if not before < POLE_RATIO * (1.0 + _largest_force(model, run)):
            return UNBOUNDED_FORCE
    else:
        emit(model, run, outlet, run.discrete)
    return select_again(model, run, outlet)


@compiled
def _keep_what_no_force_decides(model: Record, run: Record) -> None:
    """Removes guards that fired at a jump of the law only because of the state beyond it."""
    n, fired = model.num_fingers, run.guards.fired
    for i in range(n):
        base = PER_CONTACT * i
        fired[base + NORMAL_FORCE] = 0
        if run.discrete.phases[i] == 0:
            fired[base + PHASE] = 0
    fired[PER_CONTACT * n] = 0
    for k in range(model.num_unknowns):
        if run.discrete.clamps[k] != 0:
            fired[PER_CONTACT * n + 1 + k] = 0


@compiled
def _largest_force(model: Record, run: Record) -> float:
    """Largest normal force of the evaluated state [N]."""
    largest = 0.0
    for i in range(model.num_fingers):
        largest = max(largest, abs(float(run.work.forces[i, 1])))
    return largest


@compiled
def _phase_ends(model: Record, run: Record) -> bool:
    """True if the phase of a contact ends; the first contact is stored in ``run.concerned``."""
    for i in range(model.num_fingers):
        if run.guards.fired[PER_CONTACT * i + PHASE] == 1:
            run.concerned = i
            return True
    return False


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.float64)
def pass_break(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
    """Handles one jump at a known instant; further jumps follow in the next calls."""
    if run.own.asked == ANSWERED:
        return control_tick(model, run, outlet, 0, 0)
    if run.now >= t_stop:
        return RUNNING
    if model.motion.breaks[run.discrete.piece] <= run.now:
        return _change_piece(model, run, outlet)
    if model.law.period > 0.0 and next_tick(model, run) <= run.now:
        return control_tick(model, run, outlet, 0, 0)
    if next_command(run) <= run.now:
        return apply_command(model, run, outlet)
    if run.hold_until <= run.now:
        return recognise(model, run, outlet)
    return RUNNING


@compiled
def _change_piece(model: Record, run: Record, outlet: Record) -> int:
    """Handles a jump of the desired acceleration; sampled control uses it at the next tick."""
    if model.law.period > 0.0:
        pass_breaks(model.motion, run.discrete, run.now)
        return RUNNING
    keep_old(model, run)
    emit(model, run, outlet, run.discrete)
    pass_breaks(model.motion, run.discrete, run.now)
    return select_again(model, run, outlet)


@compiled
def _next_break(model: Record, run: Record, t_stop: float) -> float:
    """Next known instant at which the flow is not smooth."""
    until = min(t_stop, run.hold_until, model.motion.breaks[run.discrete.piece])
    if model.law.period > 0.0:
        until = min(until, next_tick(model, run), next_command(run))
    return until


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def begin_stretch(model: Record, run: Record, outlet: Record, first: int, same_ticks: int) -> int:
    """Starts the run, or continues it after a timed change with new constants.

    Args:
        model: The new constants.
        run: The run; in later segments, the row before the change is already written.
        outlet: Output buffers for rows and phase changes.
        first: 1 if the run starts here.
        same_ticks: 1 if the ticks of sampled control continue (same period).
    """
    run.begun = 1
    run.rank = run.quiet_steps = 0
    forget_mechanics(run.work)
    pass_breaks(model.motion, run.discrete, run.now)
    if first == 0:
        update_mechanics(model, run.step.start, run.work)
        book_energy(model, run, stored_energy, supplied_at(model))
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
        emit(model, run, outlet, run.discrete)
    keep_old(model, run)
    return select_again(model, run, outlet)


@compiled
def _emit_end(model: Record, run: Record, outlet: Record, t_stop: float) -> None:
    """Appends the row at the end of the segment."""
    emit_or_end(model, run, outlet, run.discrete, t_stop, run.step.start, t_stop)


@compiled
def _finish_step(model: Record, run: Record, outlet: Record, t_stop: float, reaches: bool) -> int:
    """Handles the jump at the end of a step, if the step reaches a known instant."""
    return pass_break(model, run, outlet, t_stop) if reaches else RUNNING


advance, advance_run = make_advance(
    LAYOUTS,
    emit=emit,
    emit_end=_emit_end,
    emit_due=emit_due,
    begin=begin_stretch,
    next_stop=_next_break,
    pass_instant=pass_break,
    take_step=take_accepted_step,
    cut=cut_at_event,
    count_step=count_step,
    emit_inside=emit_inside,
    follow_slip=follow_slip,
    leave_slip=leave_slip,
    pass_event=pass_event,
    finish_step=_finish_step,
    pace_steps=5000,
    least_pace=1e-6,
)
