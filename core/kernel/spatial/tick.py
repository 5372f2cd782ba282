"""Ticks of sampled control for spatial hands."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.links import BY_CHAIN
from slipgrasp.core.kernel.loop.motion import pass_breaks
from slipgrasp.core.kernel.loop.output import phases_changed
from slipgrasp.core.kernel.loop.progress import FREE_ROTATION, SOFTENED, warn
from slipgrasp.core.kernel.loop.sensing import trust, trust_in_contact
from slipgrasp.core.kernel.loop.status import RUNNING
from slipgrasp.core.kernel.loop.ticks import (
    add_up_impulses,
    make_control_tick,
    make_estimates,
    take_command,
)
from slipgrasp.core.kernel.spatial.chain import renew_seed
from slipgrasp.core.kernel.spatial.command import spatial_believe, spatial_command
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.jump import (
    emit_old,
    finish_jump,
    forget_leaving,
    keep_old,
    restart,
    settle,
    swap_states,
)
from slipgrasp.core.kernel.spatial.kinematics import torques_to_forces, update_kinematics
from slipgrasp.core.kernel.spatial.learning import spatial_learn
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.own_law import look
from slipgrasp.core.kernel.spatial.prediction import spatial_predict
from slipgrasp.core.kernel.spatial.run import LAYOUTS, OUTLET, PROGRESS, copy_discrete
from slipgrasp.core.kernel.spatial.sensing import (
    detect_slip,
    measure,
    measure_acceleration,
    measure_forces,
)
from slipgrasp.core.kernel.spatial.state import slip_coordinate


@compiled
def _get_estimate(_model: Record, run: Record, k: int) -> float:
    return run.discrete.estimates[k]


@compiled
def _put_estimate(_model: Record, run: Record, k: int, value: float) -> None:
    run.discrete.estimates[k] = value


_set_estimate, _advance_estimates = make_estimates(_get_estimate, _put_estimate)


@compiled
def _limit_of(model: Record, i: int, joint: int) -> float:
    return model.hand.torque_limits[i, joint]


@compiled_apart(types.void, MODEL, PROGRESS)
def spatial_update_rates(model: Record, run: Record) -> None:
    """Computes the rates of the estimates until the next tick, measured under the applied torque.

    ``run.work`` has the true accelerations before and after the call.
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
        for part in range(3):
            gamma = work.gamma[i, part] if seen_at_once else senses.gamma[i, part]
            memory.gamma[i, part] = gamma
        # Consistent with the accelerations.
        present = -model.hand.eccentricities[i] * work.moments[i]
        memory.moments[i] = present if sensors.true_accelerations == 1 else senses.moments[i]
    if sensors.perfect == 0:
        measure_acceleration(model, senses, discrete, work)
        spatial_believe(model, discrete, run.now, senses, work)
        _take_measured(model, senses, work)
    elif model.law.predicts:
        spatial_believe(model, discrete, run.now, senses, work)
    spatial_learn(model, discrete, senses.measured, work, memory)
    # The filtered acceleration is valid only after two velocity differences.
    informed = sensors.true_accelerations == 1 or senses.num_filtered > 1
    for k in range(model.num_unknowns):
        run.pending_rates[k] = work.rates[k] if informed else 0.0
    if sensors.perfect == 0:
        spatial_plant(model, discrete, start, work)


@compiled
def _take_measured(model: Record, senses: Record, work: Record) -> None:
    """Writes measured accelerations and tip forces to ``work``, with measured kinematics."""
    for k in range(6):
        work.acceleration[k] = senses.acceleration[k]
    for i in range(model.num_fingers):
        for axis in range(2):
            # In estimated stick it is 0, without the noise of the filter.
            known = model.sensors.true_accelerations == 0 and senses.slips[i, axis] == 0.0
            measured = senses.acceleration[slip_coordinate(i, axis)]
            work.slip_acceleration[i, axis] = 0.0 if known else measured
    torques_to_forces(model.hand, work.kin, senses.torques, work.tip_forces)


@compiled_apart(types.int64, MODEL, PROGRESS, OUTLET)
def spatial_apply(model: Record, run: Record, outlet: Record) -> int:
    """Applies the torques of the oldest waiting command."""
    keep_old(model, run)
    take_command(model, run)
    forget_leaving(model, run)
    return _finish_jump(model, run, outlet, settle(model, run), True)


@compiled
def _finish_jump(model: Record, run: Record, outlet: Record, status: int, before: bool) -> int:
    """Completes a jump of the torque; it gives two rows if phases change."""
    if status != RUNNING or not before or phases_changed(model, run):
        return finish_jump(model, run, outlet, status, before)
    restart(model, run)
    return RUNNING


@compiled
def _sense(model: Record, run: Record) -> None:
    """Advances the estimates and takes the measurements of a tick."""
    senses, start = run.senses, run.step.start
    keep_old(model, run)
    pass_breaks(model.motion, run.discrete, run.now)
    _advance_estimates(model, run, run.now - run.last_tick)
    run.last_tick = run.now
    measure(model, senses, start, run.discrete.torques, run.now)
    feels = model.law.facts.is_own or (model.soft == 1 and model.law.facts.has_memory)
    if feels and run.acting == 1:
        # Under the torques applied up to now.
        spatial_plant(model, run.discrete, start, run.work)
        measure_forces(model, senses, run.work)
    detect_slip(model, run.discrete, senses, start, run.now)
    if model.hand.has_chains == 1:
        _renew_seeds(model, run)


@compiled
def _renew_seeds(model: Record, run: Record) -> None:
    """Sets the initial guess of the inverse kinematics of chains until the next tick."""
    seeds, kin = run.discrete.seeds, run.work.kin
    update_kinematics(model.hand, seeds, run.step.start, kin)
    for i in range(model.num_fingers):
        if model.hand.kinds[i] == BY_CHAIN:
            renew_seed(kin.positions[i], kin.chains[i], seeds[i])


@compiled_apart(types.void, MODEL, PROGRESS)
def spatial_look(model: Record, run: Record) -> None:
    """Updates the inputs of a custom law at this tick."""
    run.discrete.violation = 0.0
    spatial_believe(model, run.discrete, run.now, run.senses, run.work)
    look(model, run)


@compiled
def _evaluate_law(model: Record, run: Record) -> int:
    """Computes the command of a built-in law; returns a status."""
    grasp = run.work.grasp
    status = spatial_command(model, run.discrete, run.now, run.senses, run.work)
    if status == RUNNING and model.law.predicts and run.acting == 1:
        status = _command_ahead(model, run)
    if status != RUNNING:
        return status
    if grasp.rank < 6 and model.soft == 0:
        warn(run, FREE_ROTATION)
    if grasp.weak > 0:
        warn(run, SOFTENED)
    return RUNNING


@compiled
def _command_ahead(model: Record, run: Record) -> int:
    """Computes the command for the state predicted for the time at which the torque acts."""
    discrete, senses, ahead, now = run.discrete, run.senses, run.prediction, run.discrete.piece
    then = run.now + model.law.latency
    add_up_impulses(model, run)
    spatial_predict(model, senses, run.work, ahead)
    pass_breaks(model.motion, discrete, then)
    swap_states(model, senses.measured, ahead.state)
    status = spatial_command(model, discrete, then, senses, run.work)
    swap_states(model, senses.measured, ahead.state)
    discrete.piece = now
    return status


@compiled
def _learn(model: Record, run: Record) -> None:
    """Computes the rates of the estimates under the torque that continues to act."""
    spatial_plant(model, run.discrete, run.step.start, run.work)
    spatial_update_rates(model, run)


@compiled
def _settle(model: Record, run: Record, _outlet: Record, first: int) -> int:
    """Selects the phases under the new torque."""
    if first == 1:
        # Every run is assumed to start in stick, under the first torque.
        copy_discrete(model, run.discrete, run.old)
    forget_leaving(model, run)
    return settle(model, run)


@compiled
def _finish(
    model: Record, run: Record, outlet: Record, status: int, first: int, stretch: int
) -> int:
    """Completes the jump; at the start of a later segment, the row before is already written."""
    if status == RUNNING:
        spatial_update_rates(model, run)
    return _finish_jump(model, run, outlet, status, stretch == 0 or first == 1)


control_tick = make_control_tick(
    LAYOUTS,
    get_estimate=_get_estimate,
    set_estimate=_set_estimate,
    limit_of=_limit_of,
    sense=_sense,
    show=spatial_look,
    evaluate_law=_evaluate_law,
    emit_before=emit_old,
    learn=_learn,
    settle=_settle,
    finish=_finish,
)
