"""Ticks of sampled control: measurement, command, actuation (with latency), adaptation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.own_law import ANSWERED, ASKED, NOTHING, ask, is_answer_finite
from slipgrasp.core.kernel.loop.progress import CLAMPED, SATURATED, Layouts, warn
from slipgrasp.core.kernel.loop.status import LAW_FAILED, RUNNING
from slipgrasp.core.kernel.numerics.elementary import nearest

SAME_TICK = 1e-9


@compiled
def next_tick(model: Record, run: Record) -> float:
    """Time of the next control tick [s]."""
    return run.tick_origin + run.ticks * model.law.period


@compiled
def restart_ticks(run: Record) -> None:
    """Starts sampled control or changes its period: the first tick is now."""
    run.tick_origin = run.now
    run.ticks = 0


@compiled
def next_command(run: Record) -> float:
    """Time at which the next waiting command acts [s], inf if none waits."""
    return run.due[run.first_waiting] if run.num_waiting > 0 else np.inf


@compiled
def take_command(model: Record, run: Record) -> None:
    """Applies the torque of the oldest waiting command."""
    place = run.first_waiting
    for i in range(model.num_fingers):
        for joint in range(run.given.shape[1]):
            run.discrete.torques[i, joint] = run.waiting[place, i, joint]
    run.first_waiting = (place + 1) % len(run.due)
    run.num_waiting -= 1


@compiled
def add_up_impulses(model: Record, run: Record) -> None:
    """Integrates the torques that will act during the latency, once and twice."""
    impulses, end = run.prediction.impulses, run.now + model.law.latency
    for i in range(model.num_fingers):
        for joint in range(run.given.shape[1]):
            impulses[0, i, joint] = impulses[1, i, joint] = 0.0
    for k in range(run.num_waiting + 1):
        place = (run.first_waiting + k - 1) % len(run.due)
        start = run.now if k == 0 else run.due[place]
        stop = end if k == run.num_waiting else run.due[(place + 1) % len(run.due)]
        span = stop - start
        for i in range(model.num_fingers):
            for joint in range(run.given.shape[1]):
                torque = run.discrete.torques[i, joint] if k == 0 else run.waiting[place, i, joint]
                impulses[0, i, joint] += span * torque
                impulses[1, i, joint] += span * (end - 0.5 * (start + stop)) * torque


@compiled
def _limit_torques(model: Record, run: Record, limit_of: Any) -> None:
    """Limits the commanded joint torques: first the rate, then the magnitude."""
    reach = model.actuators.torque_rate_limit * model.law.period
    limited = False
    for i in range(model.num_fingers):
        for joint in range(run.given.shape[1]):
            wanted = run.discrete.commanded[i, joint]
            given, last = wanted, run.given[i, joint]
            if run.acting == 1:
                given = min(max(given, last - reach), last + reach)
            limit = limit_of(model, i, joint)
            given = min(max(given, -limit), limit)
            limited = limited or given != wanted
            run.given[i, joint] = given
    if limited:
        warn(run, SATURATED)


@compiled
def _act(model: Record, run: Record) -> None:
    """Applies the limited torques immediately and discards waiting commands."""
    run.acting = 1
    run.num_waiting = 0
    for i in range(model.num_fingers):
        for joint in range(run.given.shape[1]):
            run.discrete.torques[i, joint] = run.given[i, joint]


@compiled
def _let_wait(model: Record, run: Record) -> None:
    """Adds the command to the queue; drops commands that would act after it."""
    due = run.now + model.law.latency
    periods = model.law.latency / model.law.period
    if abs(periods - nearest(periods)) < SAME_TICK:
        # Exactly at a tick, without rounding errors.
        due = run.tick_origin + (run.ticks - 1 + nearest(periods)) * model.law.period
    size = len(run.due)
    while run.num_waiting > 0:
        if run.due[(run.first_waiting + run.num_waiting - 1) % size] < due:
            break
        run.num_waiting -= 1
    place = (run.first_waiting + run.num_waiting) % size
    run.due[place] = due
    run.num_waiting += 1
    for i in range(model.num_fingers):
        for joint in range(run.given.shape[1]):
            run.waiting[place, i, joint] = run.given[i, joint]


def make_estimates(get_estimate: Any, put_estimate: Any) -> tuple[Any, Any]:
    """Creates functions that set an estimate, and that advance all estimates by their rates.

    Args:
        get_estimate: Returns the estimate of an unknown of a run.
        put_estimate: Replaces it.
    """

    @compiled
    def set_estimate(model: Record, run: Record, k: int, value: float) -> None:
        """Sets an estimate, projected onto its bounds."""
        bounded = min(max(value, model.unknowns.minimum[k]), model.unknowns.maximum[k])
        if bounded != value:
            warn(run, CLAMPED)
        put_estimate(model, run, k, bounded)

    @compiled
    def advance_estimates(model: Record, run: Record, elapsed: float) -> None:
        """Takes an Euler step over the past period, projected onto the bounds."""
        for k in range(model.num_unknowns):
            value = get_estimate(model, run, k) + elapsed * run.pending_rates[k]
            set_estimate(model, run, k, value)

    return set_estimate, advance_estimates


def make_control_tick(
    layouts: Layouts,
    *,
    get_estimate: Any,
    set_estimate: Any,
    limit_of: Any,
    sense: Any,
    show: Any,
    evaluate_law: Any,
    emit_before: Any,
    learn: Any,
    settle: Any,
    finish: Any,
) -> Any:
    """Creates the control tick of one kind of hand, as a compiled unit.

    Args:
        layouts: Records of this kind of hand.
        get_estimate: Returns the estimate of an unknown.
        set_estimate: Sets an estimate, projected onto its bounds.
        limit_of: Returns the torque limit of a joint.
        sense: Updates estimates and measurements.
        show: Updates the inputs of a custom law.
        evaluate_law: Computes the command of a built-in law; returns a status.
        emit_before: Writes the row before the jump of the torque.
        learn: Computes the rates of the estimates, with the phases before the tick.
        settle: Selects the phases under the new torque; returns a status.
        finish: Completes the jump, given that status; returns a status.
    """

    @compiled
    def _answer(model: Record, run: Record) -> int:
        """Calls a custom law and stores its torque, bounded estimates and diagnostics."""
        answer = run.own.answer
        if ask(run.own) != 0 or not is_answer_finite(model, answer):
            return LAW_FAILED
        for i in range(model.num_fingers):
            for joint in range(run.given.shape[1]):
                run.discrete.commanded[i, joint] = answer.torque[i, joint]
        for k in range(model.num_diagnostics):
            run.discrete.diagnostics[k] = answer.diagnostics[k]
        for k in range(model.num_unknowns):
            set_estimate(model, run, k, answer.estimates[k])
        return RUNNING

    @compiled
    def _store_tick(model: Record, run: Record, outlet: Record) -> None:
        """Appends the command of the law, so that the run can be repeated without the law."""
        n, p, joints = model.num_fingers, model.num_unknowns, run.given.shape[1]
        column = outlet.num_ticks * (1 + joints * n + p + model.num_diagnostics)
        outlet.ticks[column] = run.now
        for i in range(n):
            for joint in range(joints):
                outlet.ticks[column + 1 + joints * i + joint] = run.discrete.commanded[i, joint]
        column += 1 + joints * n
        for k in range(p):
            value = run.own.answer.estimates[k]
            if not model.law.facts.is_own:
                value = get_estimate(model, run, k)
            outlet.ticks[column + k] = value
        for k in range(model.num_diagnostics):
            outlet.ticks[column + p + k] = run.discrete.diagnostics[k]
        outlet.num_ticks += 1

    @compiled_apart(
        types.int64,
        *(layouts.model, layouts.progress, layouts.outlet, types.int64, types.int64),
        prefix=layouts.prefix,
    )
    def control_tick(model: Record, run: Record, outlet: Record, first: int, stretch: int) -> int:
        """Performs a tick of sampled control: new estimates, torque and phases.

        Args:
            model: Constants of the run.
            run: The run.
            outlet: Buffers for rows and phase changes.
            first: 1 at the start of the run.
            stretch: 1 at the start of a segment.
        """
        if run.own.asked == ANSWERED:
            first, stretch = run.own.first, run.own.stretch
            run.own.asked = NOTHING
        else:
            sense(model, run)
            if model.law.facts.is_own:
                show(model, run)
                if run.own.address == 0:
                    run.own.asked, run.own.first, run.own.stretch = ASKED, first, stretch
                    return RUNNING
        run.ticks += 1
        status = _answer(model, run) if model.law.facts.is_own else evaluate_law(model, run)
        if status != RUNNING:
            emit_before(model, run, outlet)
            return status
        if outlet.keeps_rows == 1:
            _store_tick(model, run, outlet)
        _limit_torques(model, run, limit_of)
        if model.law.latency > 0.0 and run.acting == 1:
            _let_wait(model, run)
            if stretch == 0:
                learn(model, run)
                return RUNNING
        else:
            _act(model, run)
        status = settle(model, run, outlet, first)
        return finish(model, run, outlet, status, first, stretch)

    return control_tick
