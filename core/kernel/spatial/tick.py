"""Ticks of sampled control in space: measure, command, act (at once or later), learn."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.numerics.elementary import nearest
from slipgrasp.core.kernel.planar.jump import LAW_FAILED, RUNNING
from slipgrasp.core.kernel.planar.laws.own_law import ANSWERED, ASKED, NOTHING, ask
from slipgrasp.core.kernel.planar.run import CLAMPED, SATURATED, phases_changed, warn
from slipgrasp.core.kernel.planar.sensing import trust, trust_in_contact
from slipgrasp.core.kernel.planar.tick import SAME_TICK
from slipgrasp.core.kernel.spatial.command import spatial_believe, spatial_command
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.jump import (
    FREE_ROTATION,
    SOFTENED,
    finish_jump,
    forget_leaving,
    keep_old,
    restart,
    settle,
)
from slipgrasp.core.kernel.spatial.kinematics import torques_to_forces
from slipgrasp.core.kernel.spatial.learning import spatial_learn
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.own_law import is_answer_finite, look
from slipgrasp.core.kernel.spatial.prediction import add_up_impulses, spatial_predict
from slipgrasp.core.kernel.spatial.run import (
    OUTLET,
    PROGRESS,
    copy_discrete,
    spatial_emit,
    store_tick,
)
from slipgrasp.core.kernel.spatial.sensing import (
    detect_slip,
    measure,
    measure_acceleration,
    measure_forces,
)


@compiled
def _advance_estimates(model: Record, run: Record) -> None:
    """One Euler step of the estimates over the period that ends now, projected on their bounds."""
    elapsed = run.now - run.last_tick
    run.last_tick = run.now
    for k in range(model.num_unknowns):
        value = run.discrete.estimates[k] + elapsed * run.pending_rates[k]
        _set_estimate(model, run, k, value)


@compiled
def _set_estimate(model: Record, run: Record, k: int, value: float) -> None:
    """Sets an estimate, projected on its bounds."""
    bounded = min(max(value, model.unknowns.minimum[k]), model.unknowns.maximum[k])
    if bounded != value:
        warn(run, CLAMPED)
    run.discrete.estimates[k] = bounded


@compiled_apart(types.void, MODEL, PROGRESS)
def spatial_update_rates(model: Record, run: Record) -> None:
    """Rates of the estimates until the next tick, from what is measured under the torque that acts.

    ``run.work`` holds the true accelerations, and does so afterwards.
    """
    discrete, senses, work, memory = run.discrete, run.senses, run.work, run.memory
    sensors, n, start = model.sensors, model.num_fingers, run.step.start
    seen_at_once = sensors.true_phases == 1 and sensors.true_accelerations == 1
    memory.trust = trust(model, senses)
    for i in range(n):
        memory.contact_trust[i] = trust_in_contact(model, senses, run.now, i)
        for axis in range(2):
            told, believed = discrete.slips[i, axis], senses.slips[i, axis]
            memory.slips[i, axis] = told if seen_at_once else believed
            gamma = work.gamma[i, axis] if seen_at_once else senses.gamma[i, axis]
            memory.gamma[i, axis] = gamma
    if sensors.perfect == 0:
        measure_acceleration(model, senses, discrete, work)
        spatial_believe(model, discrete, run.now, senses, work)
        _take_measured(model, senses, work)
    elif model.law.predicts:
        spatial_believe(model, discrete, run.now, senses, work)
    spatial_learn(model, discrete, senses.measured, work, memory)
    # Differences of the velocity say nothing before there are two of them.
    informed = sensors.true_accelerations == 1 or senses.num_filtered > 1
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k] if informed else 0.0
    if sensors.perfect == 0:
        spatial_plant(model, discrete, start, work)


@compiled
def _take_measured(model: Record, senses: Record, work: Record) -> None:
    """Accelerations and tip forces as measured; kinematics are those of what is measured."""
    for k in range(6):
        work.acceleration[k] = senses.acceleration[k]
    for i in range(model.num_fingers):
        for axis in range(2):
            # In stick it is believed to be 0, and not just by the filter's noise.
            known = model.sensors.true_accelerations == 0 and senses.slips[i, axis] == 0.0
            measured = senses.acceleration[6 + 2 * i + axis]
            work.slip_acceleration[i, axis] = 0.0 if known else measured
    torques_to_forces(model.hand, work.kin, senses.torques, work.tip_forces)


@compiled
def _limit_torques(model: Record, run: Record) -> None:
    """What the joints give of the commanded torque: limited in rate, then in size."""
    limit = model.actuators.torque_limit
    reach = model.actuators.torque_rate_limit * model.law.period
    limited = False
    for i in range(model.num_fingers):
        for joint in range(3):
            wanted = run.discrete.commanded[i, joint]
            given, last = wanted, run.given[i, joint]
            if run.acting == 1:
                given = min(max(given, last - reach), last + reach)
            given = min(max(given, -limit), limit)
            limited = limited or given != wanted
            run.given[i, joint] = given
    if limited:
        warn(run, SATURATED)


@compiled
def _act(model: Record, run: Record) -> None:
    """What the joints give acts from now on, whatever was waiting."""
    run.acting = 1
    run.num_waiting = 0
    for i in range(model.num_fingers):
        for joint in range(3):
            run.discrete.torques[i, joint] = run.given[i, joint]


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
        for joint in range(3):
            run.waiting[place, i, joint] = run.given[i, joint]


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def spatial_apply(model: Record, run: Record, outlet: Record) -> int:
    """The torque of the oldest waiting command begins to act."""
    keep_old(model, run)
    place = run.first_waiting
    for i in range(model.num_fingers):
        for joint in range(3):
            run.discrete.torques[i, joint] = run.waiting[place, i, joint]
    run.first_waiting = (place + 1) % len(run.due)
    run.num_waiting -= 1
    forget_leaving(model, run)
    return _finish(model, run, outlet, settle(model, run), True)


@compiled
def _finish(model: Record, run: Record, outlet: Record, status: int, before: bool) -> int:
    """The end of a jump of the torque, which is worth two rows where phases change."""
    if status != RUNNING or not before or phases_changed(model, run):
        return finish_jump(model, run, outlet, status, before)
    restart(model, run)
    return RUNNING


@compiled
def _sense(model: Record, run: Record) -> None:
    """New estimates, and what is measured at a tick."""
    senses, start = run.senses, run.step.start
    keep_old(model, run)
    pass_breaks(model.motion, run.discrete, run.now)
    _advance_estimates(model, run)
    run.ticks += 1
    measure(model, senses, start, run.discrete.torques, run.now)
    if model.law.facts.is_own and run.acting == 1:
        # Under the torques that act until now.
        spatial_plant(model, run.discrete, start, run.work)
        measure_forces(model, senses, run.work.forces)
    detect_slip(model, run.discrete, senses, start, run.now)


@compiled_apart(types.void, MODEL, PROGRESS)
def spatial_look(model: Record, run: Record) -> None:
    """Shows a law of one's own this tick."""
    spatial_believe(model, run.discrete, run.now, run.senses, run.work)
    look(model, run)


@compiled
def _evaluate_law(model: Record, run: Record) -> int:
    """The command of a built-in law, if it has one."""
    grasp = run.work.grasp
    status = spatial_command(model, run.discrete, run.now, run.senses, run.work)
    if status == RUNNING and model.law.predicts and run.acting == 1:
        status = _command_ahead(model, run)
    if status != RUNNING:
        return status
    if grasp.rank < 6:
        warn(run, FREE_ROTATION)
    if grasp.soft > 0:
        warn(run, SOFTENED)
    return RUNNING


@compiled
def _command_ahead(model: Record, run: Record) -> int:
    """Commands for the state that is expected when the torque acts."""
    discrete, senses, ahead, now = run.discrete, run.senses, run.prediction, run.discrete.piece
    then = run.now + model.law.latency
    add_up_impulses(model, run)
    spatial_predict(model, senses, run.work, ahead)
    pass_breaks(model.motion, discrete, then)
    _swap(model, senses.measured, ahead.state)
    status = spatial_command(model, discrete, then, senses, run.work)
    _swap(model, senses.measured, ahead.state)
    discrete.piece = now
    return status


@compiled
def _swap(model: Record, state: Record, other: Record) -> None:
    for k in range(model.num_states):
        value = state.x[k]
        state.x[k] = other.x[k]
        other.x[k] = value


@compiled
def _answer(model: Record, run: Record) -> int:
    """What a law of one's own answers: torque, estimates within their bounds, diagnostics."""
    answer, discrete = run.own.answer, run.discrete
    if ask(run.own) != 0 or not is_answer_finite(model, answer):
        return LAW_FAILED
    discrete.violation = 0.0
    for i in range(model.num_fingers):
        for joint in range(3):
            discrete.commanded[i, joint] = answer.torque[i, joint]
    for k in range(model.num_diagnostics):
        discrete.diagnostics[k] = answer.diagnostics[k]
    for k in range(model.num_unknowns):
        _set_estimate(model, run, k, answer.estimates[k])
    return RUNNING


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET, types.int64, types.int64)
def spatial_tick(model: Record, run: Record, outlet: Record, first: int, stretch: int) -> int:
    """One tick of sampled control: measure, command, act (at once or later), select, learn.

    Args:
        model: Constants of the run.
        run: The run.
        outlet: Buffers for rows and phase changes.
        first: 1 at the start of the run.
        stretch: 1 at the start of a stretch, which gives two rows.
    """
    discrete = run.discrete
    if run.own.asked == ANSWERED:
        first, stretch = run.own.first, run.own.stretch
        run.own.asked = NOTHING
    else:
        _sense(model, run)
        if model.law.facts.is_own:
            spatial_look(model, run)
            if run.own.address == 0:
                run.own.asked, run.own.first, run.own.stretch = ASKED, first, stretch
                return RUNNING
    status = _answer(model, run) if model.law.facts.is_own else _evaluate_law(model, run)
    if status != RUNNING:
        spatial_emit(model, run, outlet, run.old)
        return status
    store_tick(model, run, outlet)
    _limit_torques(model, run)
    if model.law.latency > 0.0 and run.acting == 1:
        _let_wait(model, run)
        if stretch == 0:
            spatial_plant(model, discrete, run.step.start, run.work)
            spatial_update_rates(model, run)
            return RUNNING
    else:
        _act(model, run)
    if first == 1:
        # The stick that every run assumes at its start, under the first torque.
        copy_discrete(model, discrete, run.old)
    forget_leaving(model, run)
    status = settle(model, run)
    if status == RUNNING:
        spatial_update_rates(model, run)
    # At the start of a later stretch the row before is written already.
    return _finish(model, run, outlet, status, stretch == 0 or first == 1)
