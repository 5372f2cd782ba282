"""What happens at an instant: control ticks, phase selection, recognition, timed changes."""

from __future__ import annotations

import numpy as np
from numba import types

from core.kernel.compiler import compiled, compiled_apart
from core.kernel.dynamics import stored_energy
from core.kernel.flow import flow, update_command, update_mechanics, update_rates
from core.kernel.guards import arm_guards
from core.kernel.model import MODEL
from core.kernel.records import Record
from core.kernel.reduced import forces_to_torques
from core.kernel.run import (
    AMBIGUITIES,
    CLAMPED,
    FIRST_STEP,
    HOLDS,
    OUTLET,
    PROGRESS,
    emit,
    exchange_old,
    keep_old,
    log_changes,
    pass_output_times,
    phases_changed,
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


@compiled
def next_tick(model: Record, run: Record) -> float:
    """Time of the next control tick [s]."""
    return run.tick_origin + run.ticks * model.law.period


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


@compiled
def _advance_estimates(model: Record, run: Record, elapsed: float) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    offset = 6 + 2 * model.num_fingers
    for k in range(model.num_unknowns):
        value = run.step.start.x[offset + k] + elapsed * run.pending_rates[k]
        bounded = min(max(value, model.unknowns.minimum[k]), model.unknowns.maximum[k])
        if bounded != value:
            warn(run, CLAMPED)
        run.step.start.x[offset + k] = bounded


@compiled
def _command_torques(model: Record, run: Record) -> bool:
    """New estimates and torque at a tick; False where the law has no finite answer."""
    discrete, work = run.discrete, run.work
    _advance_estimates(model, run, run.now - run.last_tick)
    run.last_tick = run.now
    run.ticks += 1
    for i in range(model.num_fingers):
        discrete.beliefs[i] = discrete.phases[i]
    update_mechanics(model, run.step.start, work)
    regular = update_command(model, discrete, run.now, run.step.start, work)
    if regular == 0 or not abs(work.estimated_factors.determinant) > 0.0:
        return False
    forces_to_torques(work.kin, model.num_fingers, work.tip_forces, discrete.torques)
    total = 0.0
    for i in range(model.num_fingers):
        total += discrete.torques[i, 0] + discrete.torques[i, 1]
    return np.isfinite(total)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def control_tick(model: Record, run: Record, outlet: Record, first: int, stretch: int) -> int:
    """One tick of sampled control: new estimates, new torque, new selection.

    Args:
        model: Constants of the run.
        run: The run.
        outlet: Buffers for rows and phase changes.
        first: 1 at the start of the run.
        stretch: 1 at the start of a stretch, where the row before is already written.
    """
    keep_old(model, run)
    status = MODEL_SINGULAR
    if _command_torques(model, run):
        if first == 1:
            keep_old(model, run)
            emit(model, run, outlet, run.now, run.step.start)
        status = settle(model, run, 0, 0)
    if status != RUNNING:
        _emit_before(model, run, outlet)
        return status
    state, work = run.step.start, run.work
    flow(model, run.discrete, run.now, state, run.step.slopes[0], work)
    update_rates(model, run.discrete, state, work)
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k]
    if stretch == 1 or phases_changed(model, run):
        if stretch == 0:
            _emit_before(model, run, outlet)
        return finish_jump(model, run, outlet, RUNNING)
    arm_guards(model, run.discrete, state, work, run.guards)
    return RUNNING


@compiled
def _emit_before(model: Record, run: Record, outlet: Record) -> None:
    """The row of the state before a jump that has already happened."""
    exchange_old(model, run)
    emit(model, run, outlet, run.now, run.step.start)
    exchange_old(model, run)


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
    if model.law.period > 0.0 and same_ticks == 0:
        run.tick_origin = run.now
        run.last_tick = run.now
        run.ticks = 0
        for k in range(model.num_unknowns):
            run.pending_rates[k] = 0.0
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
    state.x[model.num_states - 2] += kinetic + potential - before
