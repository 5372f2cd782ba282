"""Jumps of a planar run: phase selection, events consumed, recognition, restart of the flow."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import log_changes, pass_output_times
from slipgrasp.core.kernel.loop.progress import AMBIGUITIES, CLAMPED, FIRST_STEP, HOLDS, warn
from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    INCONSISTENT,
    PAINLEVE,
    RUNNING,
    SEPARATED,
    SINGULAR,
    TORQUE_NOT_FINITE,
)
from slipgrasp.core.kernel.loop.tally import count_forces
from slipgrasp.core.kernel.planar.flow import flow
from slipgrasp.core.kernel.planar.guards import (
    ESTIMATE_BAND,
    FACE,
    PER_CONTACT,
    PHASE,
    arm_guards,
    is_infeasible,
)
from slipgrasp.core.kernel.planar.kinematics import is_at_limit
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.opening import find_opening
from slipgrasp.core.kernel.planar.run import OUTLET, PROGRESS, emit, keep_old, leave_slip
from slipgrasp.core.kernel.planar.selection import (
    AMBIGUOUS,
    NONE_COMMANDED,
    NONE_CONSISTENT,
    NONE_REGULAR,
    REST_SPEED,
    is_consistent,
    select_phases,
)
from slipgrasp.core.kernel.planar.state import estimate_at, slip_at, slip_velocity_at
from slipgrasp.core.kernel.planar.stepper import effort_rate

# Margin of sin^2 q2 above its minimum below which the contact forces are inaccurate.
LOST_FORCES = 1e-4


@compiled_apart(types.int64, MODEL, PROGRESS, types.int64, types.int64)
def settle(model: Record, run: Record, instant: int, exhaustive: int) -> int:
    """Selects the phases for the new torque.

    With continuous control and no consistent candidate under instant recognition, the controller
    keeps its estimated phase for the recognition time, and the plant's phases are selected under
    the torque for that phase. If no phases with all contacts closed are consistent, a contact may
    open, which ends the run.
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
        run.concerned = find_opening(
            model, run.discrete, now, state, instant, run.work, run.selection
        )
        if run.concerned < 0 and instant == 1:
            run.concerned = find_opening(
                model, run.discrete, now, state, 0, run.work, run.selection
            )
        if run.concerned >= 0:
            return SEPARATED
        run.concerned = _nearly_singular(model, run)
        if run.concerned >= 0:
            return SINGULAR
        if verdict == NONE_COMMANDED:
            return TORQUE_NOT_FINITE
        return PAINLEVE if verdict == NONE_REGULAR else INCONSISTENT
    if verdict == AMBIGUOUS:
        warn(run, AMBIGUITIES)
    n = model.num_fingers
    for i in range(n):
        # Slip velocities treated as zero become exactly zero.
        speed = abs(state.x[slip_velocity_at(n, i)])
        if 0.0 < speed < REST_SPEED:
            run.selection.selected = 0
            state.x[slip_velocity_at(n, i)] = 0.0
    return RUNNING


@compiled
def _nearly_singular(model: Record, run: Record) -> int:
    """First finger that is too straight or folded for accurate forces; -1 if there is none."""
    for i in range(model.num_fingers):
        kin = run.work.kin
        if kin.extension[i] < LOST_FORCES and not is_at_limit(model.hand, kin, i):
            return i
    return -1


@compiled
def set_first_slope(model: Record, run: Record) -> None:
    """Computes the first slope under the current torque and evaluates ``work`` at this state."""
    step, selection = run.step, run.selection
    if selection.selected == 0:
        flow(model, run.discrete, run.now, step.start, step.slopes[0], run.work)
        return
    selection.selected = 0
    for k in range(model.num_states):
        step.slopes[0].x[k] = selection.derivative.x[k]


@compiled
def arm(model: Record, run: Record) -> None:
    """Restarts guards and force extremes after a jump, at the state evaluated in ``work``."""
    run.guards.infeasible = is_infeasible(run.work.room.violation)
    arm_guards(model, run.discrete, run.step.start, run.work, run.guards)
    count_forces(model, run.discrete, run.guards.starts, run.tally, PER_CONTACT, 1)


@compiled_apart(types.void, MODEL, PROGRESS)
def restart_flow(model: Record, run: Record) -> None:
    """Restarts the integration after an event: new first slope, armed guards, small step."""
    flow(model, run.discrete, run.now, run.step.start, run.step.slopes[0], run.work)
    run.step.efforts[0] = effort_rate(model, run.work)
    arm(model, run)
    run.step_size = min(run.step_size, FIRST_STEP)


@compiled
def consume_events(model: Record, run: Record) -> None:
    """Sets every quantity whose guard has fired exactly to its level.

    This removes rounding errors: a stopped fingertip has zero slip velocity, a fingertip at the
    end of its face part is exactly there, and an estimate at a bound equals it. An estimate whose
    rate has changed sign is released.
    """
    n, fired, state = model.num_fingers, run.guards.fired, run.step.start
    for i in range(n):
        base = PER_CONTACT * i
        if fired[base + PHASE] == 1 and run.discrete.phases[i] != 0:
            state.x[slip_velocity_at(n, i)] = 0.0
        if fired[base + FACE] == 1:
            state.x[slip_at(i)] = _nearer(
                state.x[slip_at(i)], model.hand.slip_minimum[i], model.hand.slip_maximum[i]
            )
    for k in range(model.num_unknowns):
        if fired[PER_CONTACT * n + 1 + k] == 0:
            continue
        if run.discrete.clamps[k] != 0:
            run.discrete.clamps[k] = 0
            continue
        low, high = model.unknowns.minimum[k], model.unknowns.maximum[k]
        bound = _nearer(state.x[estimate_at(n, k)], low, high)
        state.x[estimate_at(n, k)] = bound
        run.discrete.clamps[k] = 1 if bound == high else -1
        warn(run, CLAMPED)


@compiled
def _nearer(value: float, low: float, high: float) -> float:
    """The closer of two bounds."""
    return low if value - low < high - value else high


@compiled
def _clamp_estimates(model: Record, run: Record) -> None:
    """Clamps or releases the estimates at a bound after a jump that changes their rates."""
    for k in range(model.num_unknowns):
        low, high = model.unknowns.minimum[k], model.unknowns.maximum[k]
        at = estimate_at(model.num_fingers, k)
        value, rate = run.step.start.x[at], run.work.rates[k]
        clamp = 0
        if value >= high - ESTIMATE_BAND and rate > 0.0:
            clamp, value = 1, high
        elif value <= low + ESTIMATE_BAND and rate < 0.0:
            clamp, value = -1, low
        if clamp != 0 and run.discrete.clamps[k] == 0:
            warn(run, CLAMPED)
        run.discrete.clamps[k] = clamp
        run.step.start.x[at] = min(max(value, low), high)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64)
def finish_jump(model: Record, run: Record, outlet: Record, status: int) -> int:
    """Logs phase changes, writes the row after the jump and restarts the flow."""
    if status != RUNNING:
        return status
    chatters = log_changes(model, run, outlet)
    leave_slip(model, run, outlet, 0)
    emit(model, run, outlet, run.discrete)
    pass_output_times(model, run)
    if model.law.period == 0.0:
        flow(model, run.discrete, run.now, run.step.start, run.step.slopes[0], run.work)
        _clamp_estimates(model, run)
    restart_flow(model, run)
    return CHATTERING if chatters else RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def select_again(model: Record, run: Record, outlet: Record) -> int:
    """Selects phases and restarts the flow; the row before the jump is already written."""
    instant = 1 if model.law.period == 0.0 and run.hold_until == np.inf else 0
    return finish_jump(model, run, outlet, settle(model, run, instant, 1))


@compiled
def recognise(model: Record, run: Record, outlet: Record) -> int:
    """Ends a recognition time: the plant's phases become the estimated ones (continuous control).

    If they are not consistent under the torque they imply, another recognition time follows.
    """
    keep_old(model, run)
    emit(model, run, outlet, run.discrete)
    for i in range(model.num_fingers):
        run.discrete.beliefs[i] = run.discrete.phases[i]
    if is_consistent(model, run.discrete, run.now, run.step.start, run.work, run.selection) == 1:
        run.hold_until = np.inf
        return finish_jump(model, run, outlet, RUNNING)
    run.hold_until = run.now + model.law.recognition_time
    warn(run, HOLDS)
    return select_again(model, run, outlet)
