"""What happens at an instant: control ticks, phase selection, recognition, timed changes."""

from __future__ import annotations

import numpy as np
from numba import types

from core.kernel.compiler import compiled, compiled_apart
from core.kernel.flow import flow
from core.kernel.guards import arm_guards
from core.kernel.model import MODEL
from core.kernel.records import Record
from core.kernel.run import (
    AMBIGUITIES,
    CLAMPED,
    FIRST_STEP,
    HOLDS,
    OUTLET,
    PROGRESS,
    emit,
    keep_old,
    log_changes,
    pass_output_times,
    warn,
)
from core.kernel.selection import (
    AMBIGUOUS,
    NONE_CONSISTENT,
    NONE_PRESSES,
    NONE_REGULAR,
    REST_SPEED,
    is_consistent,
    select_phases,
)

(
    RUNNING,
    REACHED,
    SEPARATED,
    LEFT_FACE,
    SINGULAR,
    CHATTERING,
    INCONSISTENT,
    PAINLEVE,
    MODEL_SINGULAR,
    STEP_UNDERFLOW,
    MAX_STEPS,
) = range(11)


@compiled_apart(types.int64, MODEL, PROGRESS, types.int64, types.int64)
def settle(model: Record, run: Record, instant: int, exhaustive: int) -> int:
    """Selects the phases for the torque that acts from now on.

    With continuous control and no consistent candidate under instant recognition, the
    controller keeps the belief it had for the recognition time, and the plant's phases
    are selected under the torque of that belief.
    """
    now, state = run.now, run.step.start
    verdict = select_phases(
        model, run.discrete, now, state, instant, exhaustive, run.work, run.selection
    )
    if instant == 1 and verdict >= NONE_CONSISTENT:
        run.hold_until = now + model.law.recognition_time
        warn(run, HOLDS)
        verdict = select_phases(
            model, run.discrete, now, state, 0, exhaustive, run.work, run.selection
        )
    if verdict >= NONE_CONSISTENT:
        run.concerned = run.selection.pulling
    if verdict == NONE_PRESSES:
        return SEPARATED
    if verdict == NONE_REGULAR:
        return PAINLEVE
    if verdict == NONE_CONSISTENT:
        return INCONSISTENT
    if verdict == AMBIGUOUS:
        warn(run, AMBIGUITIES)
    n = model.num_fingers
    for i in range(n):
        # Slip velocities that counted as zero become exactly zero.
        if abs(state.x[6 + n + i]) < REST_SPEED:
            state.x[6 + n + i] = 0.0
    return RUNNING


@compiled_apart(types.void, MODEL, PROGRESS)
def restart_flow(model: Record, run: Record) -> None:
    """After a jump no slope from before is used: new first slope, guards armed, small step."""
    state = run.step.start
    flow(model, run.discrete, run.now, state, run.step.slopes[0], run.work)
    if model.law.period == 0.0 and _clamp_estimates(model, run):
        flow(model, run.discrete, run.now, state, run.step.slopes[0], run.work)
    arm_guards(model, run.discrete, state, run.work, run.guards)
    run.step_size = min(run.step_size, FIRST_STEP)


@compiled
def _clamp_estimates(model: Record, run: Record) -> bool:
    """Estimates on or past a bound rest there while their rate points outward."""
    offset = 6 + 2 * model.num_fingers
    found = False
    for k in range(model.num_unknowns):
        low, high = model.unknowns.minimum[k], model.unknowns.maximum[k]
        value = min(max(run.step.start.x[offset + k], low), high)
        run.step.start.x[offset + k] = value
        clamp = 0
        if value == high and run.work.rates[k] > 0.0:
            clamp = 1
        elif value == low and run.work.rates[k] < 0.0:
            clamp = -1
        if clamp != 0 and run.discrete.clamps[k] == 0:
            warn(run, CLAMPED)
        found = found or clamp != run.discrete.clamps[k]
        run.discrete.clamps[k] = clamp
    return found


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64)
def finish_jump(model: Record, run: Record, outlet: Record, status: int) -> int:
    """Logs phase changes, writes the row after, and prepares the flow that follows."""
    if status != RUNNING:
        return status
    chatters = log_changes(model, run, outlet)
    emit(model, run, outlet, run.now, run.step.start)
    pass_output_times(model, run)
    restart_flow(model, run)
    return CHATTERING if chatters else RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def select_again(model: Record, run: Record, outlet: Record) -> int:
    """Selection after the row before a jump has been written, and the flow that follows."""
    instant = 1 if model.law.period == 0.0 and run.hold_until == np.inf else 0
    return finish_jump(model, run, outlet, settle(model, run, instant, 1))


@compiled
def recognise(model: Record, run: Record, outlet: Record) -> int:
    """End of a recognition hold: the belief becomes the plant's phases (continuous control).

    If those are consistent under their own torque the hold is over, otherwise they are held.
    """
    keep_old(model, run)
    emit(model, run, outlet, run.now, run.step.start)
    for i in range(model.num_fingers):
        run.discrete.beliefs[i] = run.discrete.phases[i]
    if is_consistent(model, run.discrete, run.now, run.step.start, run.work, run.selection) == 1:
        run.hold_until = np.inf
        return finish_jump(model, run, outlet, RUNNING)
    run.hold_until = run.now + model.law.recognition_time
    warn(run, HOLDS)
    return select_again(model, run, outlet)
