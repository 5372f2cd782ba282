"""What happens at an instant: control ticks, phase selection, recognition, timed changes."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.dynamics import stored_energy
from core.kernel.flow import (
    flow,
    update_belief,
    update_command,
    update_mechanics,
    update_rates,
)
from core.kernel.guards import arm_guards, update_guards
from core.kernel.law import forces_to_torques
from core.kernel.records import Record
from core.kernel.run import (
    AMBIGUITIES,
    CLAMPED,
    FIRST_STEP,
    HOLDS,
    Outlet,
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
def begin_stretch(model: Record, run: Record, outlet: Outlet, first: bool, same_ticks: bool) -> int:
    """Starts the run, or goes on after a timed change under new constants.

    Args:
        model: Constants from now on.
        run: The run; at a later stretch the row before the change is already written.
        outlet: Buffers for rows and phase changes.
        first: Whether the run starts here.
        same_ticks: Whether sampled control keeps its ticks (its period did not change).
    """
    run.begun = True
    if not first:
        _book_energy(model, run)
    if model.law.period > 0.0 and not same_ticks:
        run.tick_origin = run.now
        run.last_tick = run.now
        run.ticks = 0
        run.pending_rates[:] = 0.0
        run.hold_until = np.inf
    if model.law.period > 0.0 and run.now >= next_tick(model, run):
        return _tick(model, run, outlet, first, True)
    if model.law.period == 0.0 and run.hold_until == np.inf:
        run.discrete.beliefs[:] = run.discrete.phases
    if first:
        emit(model, run, outlet, run.now, run.step.start)
    keep_old(run)
    return finish_jump(model, run, outlet, settle(model, run, outlet, True))


@compiled
def next_tick(model: Record, run: Record) -> float:
    """Time of the next control tick [s]."""
    return run.tick_origin + run.ticks * model.law.period


@compiled
def _book_energy(model: Record, run: Record) -> None:
    """Adds to the supplied energy what a timed change of mass or inertia brings in."""
    state = run.step.start
    update_mechanics(model, state, run.work)
    kinetic, potential = stored_energy(model.hand, model.truth, run.work.kin, state)
    state[model.num_states - 2] += kinetic + potential - run.last_energy


@compiled
def control_tick(model: Record, run: Record, outlet: Outlet) -> int:
    """One tick of sampled control: new estimates, new torque, new selection."""
    return _tick(model, run, outlet, False, False)


@compiled
def _tick(model: Record, run: Record, outlet: Outlet, first: bool, stretch: bool) -> int:
    state, work, discrete = run.step.start, run.work, run.discrete
    now = run.now
    keep_old(run)
    _advance_estimates(model, run, now - run.last_tick)
    run.last_tick = now
    run.ticks += 1
    discrete.beliefs[:] = discrete.phases
    update_mechanics(model, state, work)
    update_belief(model, discrete, now, state, work)
    regular = update_command(model, discrete, work)
    if not regular or not abs(work.estimated_determinant) > 0.0:
        return _end_tick(model, run, outlet, MODEL_SINGULAR)
    forces_to_torques(work.kin, model.num_fingers, work.tip_forces, discrete.torques)
    if not np.isfinite(discrete.torques.sum()):
        return _end_tick(model, run, outlet, MODEL_SINGULAR)
    if first:
        run.old_torques[:, :] = discrete.torques
        emit(model, run, outlet, now, state)
    status = settle(model, run, outlet, False)
    if status != RUNNING:
        return _end_tick(model, run, outlet, status)
    flow(model, discrete, now, state, run.step.slopes[0], work)
    update_rates(model, discrete, state, work)
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k]
    if stretch or phases_changed(model, run):
        if not stretch:
            _emit_before(model, run, outlet)
        return finish_jump(model, run, outlet, RUNNING)
    update_guards(model, discrete, state, work, run.guards)
    arm_guards(model, discrete, work, run.guards, run.levels)
    return RUNNING


@compiled
def _advance_estimates(model: Record, run: Record, elapsed: float) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    offset = 6 + 2 * model.num_fingers
    for k in range(model.num_unknowns):
        value = run.step.start[offset + k] + elapsed * run.pending_rates[k]
        bounded = min(max(value, model.unknowns.minimum[k]), model.unknowns.maximum[k])
        if bounded != value:
            warn(run, CLAMPED)
        run.step.start[offset + k] = bounded


@compiled
def _end_tick(model: Record, run: Record, outlet: Outlet, status: int) -> int:
    """A tick after which the run cannot go on: the last row is the state before it."""
    _emit_before(model, run, outlet)
    return status


@compiled
def _emit_before(model: Record, run: Record, outlet: Outlet) -> None:
    exchange_old(model, run)
    emit(model, run, outlet, run.now, run.step.start)
    exchange_old(model, run)


@compiled
def settle(model: Record, run: Record, outlet: Outlet, exhaustive: bool) -> int:
    """Selects the phases for the torque that acts from now on.

    With continuous control and no consistent candidate under instant recognition, the
    controller keeps the belief it had for the recognition time, and the plant's phases
    are selected under the torque of that belief.
    """
    now, state = run.now, run.step.start
    continuous = model.law.period == 0.0
    instant = continuous and run.hold_until == np.inf
    verdict = select_phases(
        model, run.discrete, now, state, instant, exhaustive, run.work, run.selection
    )
    if instant and verdict >= NONE_CONSISTENT:
        run.hold_until = now + model.law.recognition_time
        warn(run, HOLDS)
        verdict = select_phases(
            model, run.discrete, now, state, False, exhaustive, run.work, run.selection
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
    _rest_slow_contacts(model, run)
    return RUNNING


@compiled
def _rest_slow_contacts(model: Record, run: Record) -> None:
    """Slip velocities that counted as zero become exactly zero."""
    n = model.num_fingers
    for i in range(n):
        if abs(run.step.start[6 + n + i]) < REST_SPEED:
            run.step.start[6 + n + i] = 0.0


@compiled
def recognise(model: Record, run: Record, outlet: Outlet) -> int:
    """End of a recognition hold: the belief becomes the plant's phases (continuous control).

    If those are consistent under their own torque the hold is over, otherwise they are held.
    """
    keep_old(run)
    emit(model, run, outlet, run.now, run.step.start)
    run.discrete.beliefs[:] = run.discrete.phases
    if is_consistent(model, run.discrete, run.now, run.step.start, run.work, run.selection):
        run.hold_until = np.inf
        return finish_jump(model, run, outlet, RUNNING)
    run.hold_until = run.now + model.law.recognition_time
    warn(run, HOLDS)
    return finish_jump(model, run, outlet, settle(model, run, outlet, True))


@compiled
def change_phases(model: Record, run: Record, outlet: Outlet) -> int:
    """A guard of a phase fired: select again."""
    keep_old(run)
    emit(model, run, outlet, run.now, run.step.start)
    return finish_jump(model, run, outlet, settle(model, run, outlet, True))


@compiled
def finish_jump(model: Record, run: Record, outlet: Outlet, status: int) -> int:
    """Logs phase changes, writes the row after, and prepares the flow that follows."""
    if status != RUNNING:
        return status
    chatters = log_changes(model, run, outlet)
    emit(model, run, outlet, run.now, run.step.start)
    pass_output_times(model, run)
    restart_flow(model, run, outlet)
    return CHATTERING if chatters else RUNNING


@compiled
def restart_flow(model: Record, run: Record, outlet: Outlet) -> None:
    """After a jump no slope from before is used: new first slope, guards armed, small step."""
    state = run.step.start
    flow(model, run.discrete, run.now, state, run.step.slopes[0], run.work)
    if model.law.period == 0.0 and _clamp_estimates(model, run):
        flow(model, run.discrete, run.now, state, run.step.slopes[0], run.work)
    update_guards(model, run.discrete, state, run.work, run.guards)
    arm_guards(model, run.discrete, run.work, run.guards, run.levels)
    run.step_size = min(run.step_size, FIRST_STEP)


@compiled
def _clamp_estimates(model: Record, run: Record) -> bool:
    """Estimates on or past a bound rest there while their rate points outward."""
    offset = 6 + 2 * model.num_fingers
    found = False
    for k in range(model.num_unknowns):
        low, high = model.unknowns.minimum[k], model.unknowns.maximum[k]
        value = min(max(run.step.start[offset + k], low), high)
        run.step.start[offset + k] = value
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
