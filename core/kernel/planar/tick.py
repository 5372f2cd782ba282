"""Ticks of sampled control for planar hands."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.output import phases_changed
from slipgrasp.core.kernel.loop.sensing import trust, trust_in_contact
from slipgrasp.core.kernel.loop.status import MODEL_SINGULAR, RUNNING, TORQUE_NOT_FINITE
from slipgrasp.core.kernel.loop.ticks import (
    add_up_impulses,
    make_control_tick,
    make_estimates,
    take_command,
)
from slipgrasp.core.kernel.planar.flow import (
    flow,
    forget_mechanics,
    solve_plant,
    update_command,
    update_mechanics,
    update_seen_mechanics,
)
from slipgrasp.core.kernel.planar.jump import arm, finish_jump, set_first_slope, settle
from slipgrasp.core.kernel.planar.law import believe
from slipgrasp.core.kernel.planar.laws.interface import adapt_at_tick
from slipgrasp.core.kernel.planar.laws.own_law import look
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.prediction import predict
from slipgrasp.core.kernel.planar.reduced import forces_to_torques, torques_to_forces
from slipgrasp.core.kernel.planar.run import LAYOUTS, OUTLET, PROGRESS, emit, keep_old
from slipgrasp.core.kernel.planar.sensing import (
    detect_slip,
    measure,
    measure_acceleration,
    measure_forces,
)
from slipgrasp.core.kernel.planar.state import count_coordinates, estimate_at


@compiled
def _get_estimate(model: Record, run: Record, k: int) -> float:
    return run.step.start.x[estimate_at(model.num_fingers, k)]


@compiled
def _put_estimate(model: Record, run: Record, k: int, value: float) -> None:
    run.step.start.x[estimate_at(model.num_fingers, k)] = value


_set_estimate, _advance_estimates = make_estimates(_get_estimate, _put_estimate)


@compiled
def _limit_of(model: Record, i: int, joint: int) -> float:
    return model.hand.torque_limits[i, joint]


@compiled
def leave_ticks(model: Record, run: Record) -> None:
    """Switches to continuous control: discards held and waiting torques and filter states.

    The estimates are first advanced to the current time.
    """
    _advance_estimates(model, run, run.now - run.last_tick)
    run.acting = 0
    run.num_waiting = 0
    run.senses.num_filtered = 0
    for k in range(model.num_unknowns):
        run.pending_rates[k] = 0.0


@compiled_apart(types.void, MODEL, PROGRESS)
def _learn(model: Record, run: Record) -> None:
    """Computes the first slope and the rates of the estimates until the next tick.

    The rates are those at the measured state, with the acceleration under the applied torque.
    """
    n, discrete, senses, work = model.num_fingers, run.discrete, run.senses, run.work
    state = run.step.start
    set_first_slope(model, run)
    if model.law.facts.is_own:
        for k in range(model.num_unknowns):
            run.pending_rates[k] = 0.0  # of the previous law
        return
    seen_at_once = model.sensors.true_phases == 1 and model.sensors.true_accelerations == 1
    run.memory.trust = trust(model, senses)
    for i in range(n):
        run.memory.contact_trust[i] = trust_in_contact(model, senses, run.now, i)
        run.memory.directions[i] = discrete.phases[i] if seen_at_once else discrete.beliefs[i]
    # The estimated model is up to date if the command was computed at the true state.
    up_to_date = model.sensors.perfect == 1 and not model.law.predicts
    if up_to_date:
        adapt_at_tick(model, discrete, state, work, run.memory)
    else:
        measure_acceleration(model, senses, discrete, work)
        update_seen_mechanics(model, senses.measured, work)
        update_command(model, discrete, run.now, senses.measured, work)
        for k in range(count_coordinates(n)):
            work.acceleration[k] = senses.acceleration[k]
            if k >= 3 and model.sensors.true_accelerations == 0 and discrete.beliefs[k - 3] == 0:
                work.acceleration[k] = 0.0  # estimated stick: remove the noise of the filter
        torques_to_forces(work.kin, n, senses.torques, work.tip_forces)
        adapt_at_tick(model, discrete, senses.measured, work, run.memory)
    # The filtered acceleration is valid only after two velocity differences.
    informed = model.sensors.true_accelerations == 1 or senses.num_filtered > 1
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k] if informed else 0.0
    if not up_to_date:
        flow(model, discrete, run.now, state, run.step.slopes[0], work)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def apply_command(model: Record, run: Record, outlet: Record) -> int:
    """Applies the torques of the oldest waiting command."""
    keep_old(model, run)
    take_command(model, run)
    status = settle(model, run, 0, 0)
    if status != RUNNING:
        _emit_before(model, run, outlet)
        return status
    set_first_slope(model, run)
    return _finish_tick(model, run, outlet, 0)


@compiled
def _finish_tick(model: Record, run: Record, outlet: Record, stretch: int) -> int:
    if stretch == 1 or phases_changed(model, run):
        if stretch == 0:
            _emit_before(model, run, outlet)
        return finish_jump(model, run, outlet, RUNNING)
    arm(model, run)
    return RUNNING


@compiled
def _emit_before(model: Record, run: Record, outlet: Record) -> None:
    """Appends the row before a jump that has already happened.

    The row already has the new motion segment and grip, although the torque does not yet.
    """
    run.old.piece, run.old.added_grip = run.discrete.piece, run.discrete.added_grip
    emit(model, run, outlet, run.old)


@compiled
def _sense(model: Record, run: Record) -> None:
    """Advances the estimates and takes the measurements of a tick."""
    senses = run.senses
    keep_old(model, run)
    pass_breaks(model.motion, run.discrete, run.now)
    _advance_estimates(model, run, run.now - run.last_tick)
    run.last_tick = run.now
    measure(model, senses, run.step.start, run.discrete.torques, run.now)
    if model.law.facts.is_own and run.acting == 1:
        _feel(model, run)
    detect_slip(model, run.discrete, senses, run.now)
    update_seen_mechanics(model, senses.measured, run.work)
    if model.law.facts.is_own:
        believe(model.law, model.truth, model.unknowns, senses.measured, run.work.believed)


@compiled
def _feel(model: Record, run: Record) -> None:
    """Measures the contact forces under the torques applied up to now."""
    work = run.work
    update_mechanics(model, run.step.start, work)
    torques_to_forces(work.kin, model.num_fingers, run.discrete.torques, work.tip_forces)
    solve_plant(model, run.discrete, work)
    measure_forces(model, run.senses, work.forces)


@compiled
def _evaluate_law(model: Record, run: Record) -> int:
    n, work = model.num_fingers, run.work
    work.quadratic.warm = 1
    regular = update_command(model, run.discrete, run.now, run.senses.measured, work)
    if model.law.predicts and run.acting == 1:
        regular = min(regular, _command_ahead(model, run))
    work.quadratic.warm = 0
    if regular == 0 or work.estimated_factors.determinant == 0.0:
        return MODEL_SINGULAR
    commanded = run.discrete.commanded
    forces_to_torques(work.kin, n, work.tip_forces, commanded)
    total = 0.0
    for i in range(n):
        total += commanded[i, 0] + commanded[i, 1]
    return RUNNING if np.isfinite(total) else TORQUE_NOT_FINITE


@compiled
def _command_ahead(model: Record, run: Record) -> int:
    """Computes the command for the state predicted for the time at which the torque acts."""
    discrete, work, now = run.discrete, run.work, run.discrete.piece
    ahead, then = run.prediction.state, run.now + model.law.latency
    add_up_impulses(model, run)
    predict(model, discrete, run.senses.measured, work, run.prediction)
    pass_breaks(model.motion, discrete, then)
    forget_mechanics(work)  # the prediction has overwritten the bias
    update_seen_mechanics(model, ahead, work)
    regular = update_command(model, discrete, then, ahead, work)
    discrete.piece = now
    return regular


@compiled
def _settle(model: Record, run: Record, outlet: Record, first: int) -> int:
    """Selects the phases under the new torque; first appends the initial row of the run."""
    if first == 1:
        keep_old(model, run)
        emit(model, run, outlet, run.discrete)
    return settle(model, run, 0, 0)


@compiled
def _finish(
    model: Record, run: Record, outlet: Record, status: int, _first: int, stretch: int
) -> int:
    """Completes the jump; at the start of a segment, the row before is already written."""
    if status != RUNNING:
        _emit_before(model, run, outlet)
        return status
    _learn(model, run)
    return _finish_tick(model, run, outlet, stretch)


control_tick = make_control_tick(
    LAYOUTS,
    get_estimate=_get_estimate,
    set_estimate=_set_estimate,
    limit_of=_limit_of,
    sense=_sense,
    show=look,
    evaluate_law=_evaluate_law,
    emit_before=_emit_before,
    learn=_learn,
    settle=_settle,
    finish=_finish,
)
