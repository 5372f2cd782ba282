"""Ticks of sampled control: measure, command, act (at once or later), learn."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.numerics.elementary import nearest
from slipgrasp.core.kernel.planar.flow import (
    flow,
    forget_mechanics,
    solve_plant,
    update_command,
    update_mechanics,
    update_seen_mechanics,
)
from slipgrasp.core.kernel.planar.jump import (
    LAW_FAILED,
    MODEL_SINGULAR,
    RUNNING,
    TORQUE_NOT_FINITE,
    arm,
    finish_jump,
    set_first_slope,
    settle,
)
from slipgrasp.core.kernel.planar.law import believe
from slipgrasp.core.kernel.planar.laws.interface import adapt_at_tick
from slipgrasp.core.kernel.planar.laws.own_law import (
    ANSWERED,
    ASKED,
    NOTHING,
    ask,
    is_answer_finite,
    look,
)
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.prediction import predict
from slipgrasp.core.kernel.planar.reduced import forces_to_torques, torques_to_forces
from slipgrasp.core.kernel.planar.run import (
    CLAMPED,
    OUTLET,
    PROGRESS,
    SATURATED,
    emit,
    exchange_old,
    keep_old,
    phases_changed,
    warn,
)
from slipgrasp.core.kernel.planar.sensing import (
    detect_slip,
    measure,
    measure_acceleration,
    measure_forces,
    trust,
    trust_in_contact,
)
from slipgrasp.core.kernel.planar.state import estimate_at

SAME_TICK = 1e-9


@compiled
def next_tick(model: Record, run: Record) -> float:
    """Time of the next control tick [s]."""
    return run.tick_origin + run.ticks * model.law.period


@compiled
def restart_ticks(run: Record) -> None:
    """Sampled control begins, or goes on with another period: its first tick is now."""
    run.tick_origin = run.now
    run.ticks = 0


@compiled
def _advance_estimates(model: Record, run: Record, elapsed: float) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    for k in range(model.num_unknowns):
        value = run.step.start.x[estimate_at(model.num_fingers, k)]
        _set_estimate(model, run, k, value + elapsed * run.pending_rates[k])


@compiled
def _set_estimate(model: Record, run: Record, k: int, value: float) -> None:
    """Sets an estimate, projected on its bounds."""
    bounded = min(max(value, model.unknowns.minimum[k]), model.unknowns.maximum[k])
    if bounded != value:
        warn(run, CLAMPED)
    run.step.start.x[estimate_at(model.num_fingers, k)] = bounded


@compiled
def leave_ticks(model: Record, run: Record) -> None:
    """Continuous control: no torque is held, none waits, and no tick before counts any more.

    The estimates take their step of the period that ends here.
    """
    _advance_estimates(model, run, run.now - run.last_tick)
    run.acting = 0
    run.num_waiting = 0
    run.senses.num_filtered = 0
    for k in range(model.num_unknowns):
        run.pending_rates[k] = 0.0


@compiled
def next_command(run: Record) -> float:
    """When the next waiting command acts [s], inf if none waits."""
    return run.due[run.first_waiting] if run.num_waiting > 0 else np.inf


@compiled_apart(types.void, MODEL, PROGRESS)
def _learn(model: Record, run: Record) -> None:
    """First slope under the torque that acts, and the rates of the estimates until the next tick.

    They are those at the measured state with the acceleration under that torque.
    """
    n, discrete, senses, work = model.num_fingers, run.discrete, run.senses, run.work
    state = run.step.start
    set_first_slope(model, run)
    if model.law.facts.is_own:
        for k in range(model.num_unknowns):
            run.pending_rates[k] = 0.0  # of the law before it
        return
    seen_at_once = model.sensors.true_phases == 1 and model.sensors.true_accelerations == 1
    run.memory.trust = trust(model, senses)
    for i in range(n):
        run.memory.contact_trust[i] = trust_in_contact(model, senses, run.now, i)
        run.memory.directions[i] = discrete.phases[i] if seen_at_once else discrete.beliefs[i]
    # The law's model is up to date where it has commanded from the true state.
    up_to_date = model.sensors.perfect == 1 and not model.law.predicts
    if up_to_date:
        adapt_at_tick(model, discrete, state, work, run.memory)
    else:
        measure_acceleration(model, senses, discrete, work)
        update_seen_mechanics(model, senses.measured, work)
        update_command(model, discrete, run.now, senses.measured, work)
        for k in range(3 + n):
            work.acceleration[k] = senses.acceleration[k]
            if k >= 3 and model.sensors.true_accelerations == 0 and discrete.beliefs[k - 3] == 0:
                work.acceleration[k] = 0.0  # believed to be 0, and not just by the filter's noise
        torques_to_forces(work.kin, n, senses.torques, work.tip_forces)
        adapt_at_tick(model, discrete, senses.measured, work, run.memory)
    # Differences of the velocity say nothing before there are two of them.
    informed = model.sensors.true_accelerations == 1 or senses.num_filtered > 1
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k] if informed else 0.0
    if not up_to_date:
        flow(model, discrete, run.now, state, run.step.slopes[0], work)


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
    if run.own.asked == ANSWERED:
        first, stretch = run.own.first, run.own.stretch
        run.own.asked = NOTHING
    else:
        keep_old(model, run)
        _sense(model, run)
        if model.law.facts.is_own:
            look(model, run)
            if run.own.address == 0:
                run.own.asked, run.own.first, run.own.stretch = ASKED, first, stretch
                return RUNNING
    status = _command_torques(model, run, outlet)
    if status == RUNNING:
        if model.law.latency > 0.0 and run.acting == 1:
            _let_wait(model, run)
            if stretch == 0:
                _learn(model, run)
                return RUNNING
        else:
            _act(model, run)
        if first == 1:
            keep_old(model, run)
            emit(model, run, outlet, run.now, run.step.start)
        status = settle(model, run, 0, 0)
    if status != RUNNING:
        _emit_before(model, run, outlet)
        return status
    _learn(model, run)
    return _finish_tick(model, run, outlet, stretch)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def apply_command(model: Record, run: Record, outlet: Record) -> int:
    """The torque of the oldest waiting command begins to act."""
    keep_old(model, run)
    place = run.first_waiting
    for i in range(model.num_fingers):
        for joint in range(2):
            run.discrete.torques[i, joint] = run.waiting[place, i, joint]
    run.first_waiting = (place + 1) % len(run.due)
    run.num_waiting -= 1
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
    """The row of the state before a jump that has already happened."""
    exchange_old(model, run)
    emit(model, run, outlet, run.now, run.step.start)
    exchange_old(model, run)


@compiled
def _sense(model: Record, run: Record) -> None:
    """New estimates, and what is measured at a tick."""
    senses = run.senses
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
    """Measures the contact forces under the torques that act until now."""
    work = run.work
    update_mechanics(model, run.step.start, work)
    torques_to_forces(work.kin, model.num_fingers, run.discrete.torques, work.tip_forces)
    solve_plant(model, run.discrete, work)
    measure_forces(model, run.senses, work.forces)


@compiled
def _command_torques(model: Record, run: Record, outlet: Record) -> int:
    """The torque that follows from what was measured; RUNNING where it is finite."""
    run.ticks += 1
    status = _answer(model, run) if model.law.facts.is_own else _evaluate_law(model, run)
    if status != RUNNING:
        return status
    for i in range(model.num_fingers):
        for joint in range(2):
            run.discrete.commanded[i, joint] = run.commanded[i, joint]
    if outlet.keeps_rows == 1:
        _store_tick(model, run, outlet)
    _limit_torques(model, run)
    return RUNNING


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
    forces_to_torques(work.kin, n, work.tip_forces, run.commanded)
    total = 0.0
    for i in range(n):
        total += run.commanded[i, 0] + run.commanded[i, 1]
    return RUNNING if np.isfinite(total) else TORQUE_NOT_FINITE


@compiled
def _answer(model: Record, run: Record) -> int:
    """What a law of one's own answers: torque, estimates within their bounds, diagnostics."""
    answer = run.own.answer
    if ask(run.own) != 0 or not is_answer_finite(model, answer):
        return LAW_FAILED
    for i in range(model.num_fingers):
        for joint in range(2):
            run.commanded[i, joint] = answer.torque[i, joint]
    for k in range(model.num_diagnostics):
        run.discrete.diagnostics[k] = answer.diagnostics[k]
    for k in range(model.num_unknowns):
        _set_estimate(model, run, k, answer.estimates[k])
    return RUNNING


@compiled
def _store_tick(model: Record, run: Record, outlet: Record) -> None:
    """Appends what the law answered: with it the run can be made again without the law."""
    n, p = model.num_fingers, model.num_unknowns
    column = outlet.num_ticks * (1 + 2 * n + p + model.num_diagnostics)
    outlet.ticks[column] = run.now
    for i in range(n):
        for joint in range(2):
            outlet.ticks[column + 1 + 2 * i + joint] = run.commanded[i, joint]
    column += 1 + 2 * n
    for k in range(p):
        value = run.own.answer.estimates[k]
        if not model.law.facts.is_own:
            value = run.step.start.x[estimate_at(n, k)]
        outlet.ticks[column + k] = value
    for k in range(model.num_diagnostics):
        outlet.ticks[column + p + k] = run.discrete.diagnostics[k]
    outlet.num_ticks += 1


@compiled
def _command_ahead(model: Record, run: Record) -> int:
    """Commands for the state that is expected when the torque acts."""
    discrete, work, now = run.discrete, run.work, run.discrete.piece
    ahead, then = run.prediction.state, run.now + model.law.latency
    _add_up_impulses(model, run)
    predict(model, discrete, run.senses.measured, work, run.prediction)
    pass_breaks(model.motion, discrete, then)
    forget_mechanics(work)  # the prediction has its own bias
    update_seen_mechanics(model, ahead, work)
    regular = update_command(model, discrete, then, ahead, work)
    discrete.piece = now
    return regular


@compiled
def _add_up_impulses(model: Record, run: Record) -> None:
    """Integrates the torques that will act over the latency from now, once and twice."""
    impulses, end = run.prediction.impulses, run.now + model.law.latency
    for i in range(model.num_fingers):
        for joint in range(2):
            impulses[0, i, joint] = impulses[1, i, joint] = 0.0
    for k in range(run.num_waiting + 1):
        place = (run.first_waiting + k - 1) % len(run.due)
        start = run.now if k == 0 else run.due[place]
        stop = end if k == run.num_waiting else run.due[(place + 1) % len(run.due)]
        span = stop - start
        for i in range(model.num_fingers):
            for joint in range(2):
                torque = run.discrete.torques[i, joint] if k == 0 else run.waiting[place, i, joint]
                impulses[0, i, joint] += span * torque
                impulses[1, i, joint] += span * (end - 0.5 * (start + stop)) * torque


@compiled
def _limit_torques(model: Record, run: Record) -> None:
    """What the joints give of the commanded torque: limited in rate, then in size."""
    limit = model.actuators.torque_limit
    reach = model.actuators.torque_rate_limit * model.law.period
    limited = False
    for i in range(model.num_fingers):
        for joint in range(2):
            wanted = run.commanded[i, joint]
            given = wanted
            if run.acting == 1:
                last = run.last_command[i, joint]
                given = min(max(given, last - reach), last + reach)
            given = min(max(given, -limit), limit)
            limited = limited or given != wanted
            run.commanded[i, joint] = given
            run.last_command[i, joint] = given
    if limited:
        warn(run, SATURATED)


@compiled
def _act(model: Record, run: Record) -> None:
    """The commanded torque acts from now on, whatever was waiting."""
    run.acting = 1
    run.num_waiting = 0
    for i in range(model.num_fingers):
        for joint in range(2):
            run.discrete.torques[i, joint] = run.commanded[i, joint]


@compiled
def _let_wait(model: Record, run: Record) -> None:
    """Puts the command in the queue; those that would act after it are dropped."""
    due = run.now + model.law.latency
    periods = model.law.latency / model.law.period
    if abs(periods - nearest(periods)) < SAME_TICK:
        # The very instant of a tick, not one rounding beside it.
        due = run.tick_origin + (run.ticks - 1 + nearest(periods)) * model.law.period
    room = len(run.due)
    while run.num_waiting > 0:
        if run.due[(run.first_waiting + run.num_waiting - 1) % room] < due:
            break
        run.num_waiting -= 1
    place = (run.first_waiting + run.num_waiting) % room
    run.due[place] = due
    run.num_waiting += 1
    for i in range(model.num_fingers):
        for joint in range(2):
            run.waiting[place, i, joint] = run.commanded[i, joint]
