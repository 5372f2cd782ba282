"""The hybrid loop in resumable pieces: flow, detect, locate, jump."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED, ASKED
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.progress import (
    CHANGE_CAPACITY,
    ROOM_TO_SPARE,
    ROWS_BEFORE_PAUSE,
    TICKS_BEFORE_PAUSE,
)
from slipgrasp.core.kernel.loop.status import (
    EVENT_STALL,
    LEFT_FACE,
    MAX_STEPS,
    NOT_FINITE,
    PAINLEVE,
    REACHED,
    RUNNING,
    SEPARATED,
    STEP_UNDERFLOW,
    STIFF,
    UNBOUNDED_FORCE,
)
from slipgrasp.core.kernel.loop.status import SINGULAR as FINGER_SINGULAR
from slipgrasp.core.kernel.loop.ticks import next_command, next_tick, restart_ticks
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.extremes import count_step
from slipgrasp.core.kernel.planar.flow import forget_mechanics, update_mechanics
from slipgrasp.core.kernel.planar.guards import FACE, NORMAL_FORCE, PER_CONTACT, PHASE, SINGULAR
from slipgrasp.core.kernel.planar.jump import (
    consume_events,
    recognise,
    restart_flow,
    select_again,
)
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import (
    OUTLET,
    PROGRESS,
    emit,
    emit_before_jump,
    emit_due,
    emit_or_end,
    evaluate_at,
    keep_old,
)
from slipgrasp.core.kernel.planar.slip_rows import follow_slip, leave_slip
from slipgrasp.core.kernel.planar.state import supplied_at
from slipgrasp.core.kernel.planar.steps import (
    AT_POLE,
    cut_at_event,
    emit_inside,
    take_accepted_step,
)
from slipgrasp.core.kernel.planar.tick import (
    apply_command,
    control_tick,
    leave_ticks,
)

STALLED = 1e-9
MAX_STALLS = 20
# A loop whose steps must be this short on the average is too stiff to follow.
PACE_STEPS = 5000
LEAST_PACE = 1e-6  # [s]
# A force that falls to so small a share of itself where the law jumps had no bound before.
POLE_RATIO = 1e3


@compiled
def _find_end(model: Record, run: Record) -> int:
    """Whether a fired guard ends the run, and which contact or finger is concerned."""
    n, fired = model.num_fingers, run.guards.fired
    for i in range(n):
        base = PER_CONTACT * i
        status = RUNNING
        if fired[base + NORMAL_FORCE] == 1:
            status = SEPARATED
        elif fired[base + FACE] == 1:
            status = LEFT_FACE
        elif fired[base + SINGULAR] == 1:
            status = FINGER_SINGULAR
        if status != RUNNING:
            run.concerned = i
            return status
    if fired[PER_CONTACT * n] == 1:
        return PAINLEVE
    return RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def pass_event(model: Record, run: Record, outlet: Record) -> int:
    """What the guards that fired mean: the end of the run, another phase, or a bound reached.

    LEFT_FACE ends the stretch; the run goes on where the face does, with other friction.
    """
    run.stalls = run.stalls + 1 if run.now - run.last_event < STALLED else 0
    run.last_event = run.now
    law_jumps = run.guards.fired[run.guards.count - 1] == 1
    if law_jumps:
        _keep_what_no_force_decides(model, run)
    status = _find_end(model, run)
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
    """Of the guards that fired where the law jumps: the others only saw the far side of it."""
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
    """The largest normal force of the state just evaluated, in size [N]."""
    largest = 0.0
    for i in range(model.num_fingers):
        largest = max(largest, abs(float(run.work.forces[i, 1])))
    return largest


@compiled
def _phase_ends(model: Record, run: Record) -> bool:
    """Whether a contact that has fired ends its phase; the first of them is concerned."""
    for i in range(model.num_fingers):
        if run.guards.fired[PER_CONTACT * i + PHASE] == 1:
            run.concerned = i
            return True
    return False


@compiled
def _is_stiff(run: Record) -> bool:
    """Whether the latest steps were so short that the run would never end."""
    steps = run.steps - run.pace_steps
    if steps < PACE_STEPS:
        return False
    pace = (run.now - run.pace_time) / steps
    run.pace_steps, run.pace_time = run.steps, run.now
    return pace < LEAST_PACE


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.float64)
def pass_break(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
    """The jump at an instant known beforehand; one kind at a time, the rest follow at once."""
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
    """The desired acceleration jumps; under sampled control it is seen at the next tick."""
    if model.law.period > 0.0:
        pass_breaks(model.motion, run.discrete, run.now)
        return RUNNING
    keep_old(model, run)
    emit(model, run, outlet, run.discrete)
    pass_breaks(model.motion, run.discrete, run.now)
    return select_again(model, run, outlet)


@compiled
def _next_break(model: Record, run: Record, t_stop: float) -> float:
    """The next instant at which the flow is not smooth for a known reason."""
    until = min(t_stop, run.hold_until, model.motion.breaks[run.discrete.piece])
    if model.law.period > 0.0:
        until = min(until, next_tick(model, run), next_command(run))
    return until


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
    run.rank = run.quiet_steps = 0
    forget_mechanics(run.work)
    pass_breaks(model.motion, run.discrete, run.now)
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
        emit(model, run, outlet, run.discrete)
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


@compiled
def _advance_once(model: Record, run: Record, outlet: Record, t_stop: float) -> int:
    """One step, cut at the first event in it, and the jump at its end if there is one."""
    now, step = run.now, run.step
    until = _next_break(model, run, t_stop)
    if until > now:
        emit_due(model, run, outlet)
        taken = take_accepted_step(model, run, until)
        if taken == 0.0:
            emit(model, run, outlet, run.discrete)
            return STEP_UNDERFLOW
        h = cut_at_event(model, run, taken)
        if h == 0.0 and run.fired != 1:
            emit(model, run, outlet, run.discrete)
            return UNBOUNDED_FORCE if run.fired == AT_POLE else STEP_UNDERFLOW
        count_step(model, run, h)
        emit_inside(model, run, outlet, h)
        follow_slip(model, run, outlet, h)
        last = method_of(model, step).last
        for k in range(model.num_states):
            step.start.x[k] = step.end.x[k]
            step.slopes[0].x[k] = step.slopes[last].x[k]
        step.efforts[0] = step.efforts[last]
        reaches = h == until - now and run.fired == 0
        run.now = until if reaches else now + h
        if run.fired == 1:
            return pass_event(model, run, outlet)
        if not reaches:
            return RUNNING
    return pass_break(model, run, outlet, t_stop)


@compiled
def _advance_steps(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    first: int,
    same_ticks: int,
    max_steps: int,
) -> int:
    """What `advance` does, but for the rows of a slip in which the stretch ends."""
    if run.begun == 0:
        status = begin_stretch(model, run, outlet, first, same_ticks)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        if status != RUNNING:
            return status
    for _ in range(max_steps):
        if run.own.asked == ASKED:
            return RUNNING
        if outlet.num_rows > ROWS_BEFORE_PAUSE or outlet.num_ticks >= TICKS_BEFORE_PAUSE:
            return RUNNING
        if run.num_changes > CHANGE_CAPACITY - ROOM_TO_SPARE:
            return RUNNING
        if run.now >= t_stop:
            emit_or_end(model, run, outlet, run.discrete, t_stop, run.step.start, t_stop)
            return NOT_FINITE if run.lost == 1 else REACHED
        if run.steps >= model.numerics.max_steps:
            emit(model, run, outlet, run.discrete)
            return MAX_STEPS
        status = _advance_once(model, run, outlet, t_stop)
        if status == RUNNING and run.lost == 1:
            status = NOT_FINITE
        elif status == RUNNING and _is_stiff(run):
            emit(model, run, outlet, run.discrete)
            status = STIFF
        if status != RUNNING:
            return status
    return RUNNING


@compiled_apart(
    types.int64, MODEL, PROGRESS, OUTLET, types.float64, types.int64, types.int64, types.int64
)
def advance(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    first: int,
    same_ticks: int,
    max_steps: int,
) -> int:
    """Advances the run by at most ``max_steps`` steps, at most to ``t_stop``.

    Args:
        model: Constants up to ``t_stop``.
        run: The run.
        outlet: Buffers for rows and phase changes that the caller empties.
        t_stop: End of the run, or the next timed change [s].
        first: 1 where the run starts with this stretch.
        same_ticks: 1 where sampled control keeps its ticks from the stretch before.
        max_steps: Budget, so that a call stays short.

    Returns:
        RUNNING to be called again, REACHED at ``t_stop``, else why the run ended.
    """
    status = _advance_steps(model, run, outlet, t_stop, first, same_ticks, max_steps)
    if status != RUNNING:
        leave_slip(model, run, outlet, 1)
    return status


def advance_run(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    *,
    first: bool,
    same_ticks: bool,
    max_steps: int,
) -> int:
    """Advances a run as `advance` does; from Python, without the GIL."""
    flags = int(first), int(same_ticks)
    status: int = call(advance, model, run, outlet, t_stop, *flags, max_steps)
    return status
