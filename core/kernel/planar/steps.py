"""Steps within tolerance, shortened to their first event, and the rows inside them."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.ledger import (
    FAST_RATE,
    LEAST_LEDGER_STEP,
    allowed_imbalance,
    make_energy_balance,
)
from slipgrasp.core.kernel.loop.location import LOCATION_SHARE, make_locate
from slipgrasp.core.kernel.loop.output import next_output
from slipgrasp.core.kernel.loop.progress import AT_POLE, OUTPUT_ROUNDING
from slipgrasp.core.kernel.loop.stages import interpolate
from slipgrasp.core.kernel.numerics.elementary import root
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.dynamics import stored_energy
from slipgrasp.core.kernel.planar.flow import flow, update_mechanics
from slipgrasp.core.kernel.planar.guards import (
    NORMAL_FORCE,
    PER_CONTACT,
    find_fired,
    find_overlooked,
    is_past_band,
    is_past_event,
    keep_first_fired,
    least_fired,
    pass_step,
)
from slipgrasp.core.kernel.planar.interior import find_dip
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import (
    LAYOUTS,
    OUTLET,
    PROGRESS,
    emit_or_end,
    evaluate_at,
    store_row,
)
from slipgrasp.core.kernel.planar.state import (
    ANGLE,
    count_coordinates,
    dissipated_at,
    slip_velocity_at,
    supplied_at,
    velocity_at,
)
from slipgrasp.core.kernel.planar.stepper import (
    QUIET,
    is_quiet,
    prepare_interpolant,
    step_error,
    take_step,
)
from slipgrasp.core.kernel.planar.sticking import moves_object_alone

LEAST_STEP = 1e-13
MAX_GROWTH = 10.0
QUIET_STEPS = 100
LARGEST_ZERO = 1e-10
MAX_CUTS = 50
ROUGH = 1.0
# Largest velocity change across a jump of the law, in addition to the tolerance of steps.
VELOCITY_JUMP = 1e-9  # [m/s, rad/s]
CROSSING = 1e-3  # size of a step across a jump of the law, relative to a rejected one
POLE = 1.0  # a normal force below its located zero by more than this passed through infinity [N]

_balance = make_energy_balance(stored_energy, supplied_at, dissipated_at)


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64, unrolled=True)
def take_accepted_step(model: Record, run: Record, until: float) -> float:
    """Takes a step within tolerance, at most to ``until``; returns its size, 0 on failure."""
    numerics, now, step = model.numerics, run.now, run.step
    rest, sticks = until - now, moves_object_alone(model, run.discrete)
    h = min(run.step_size, numerics.max_step)
    while True:
        size = rest if h >= rest * (1.0 - 1e-9) else h
        step.rank = run.rank if sticks else model.num_methods - 1
        take_step(model, run.discrete, now, size, step, run.work)
        run.steps += 1
        fast = size > LEAST_LEDGER_STEP and _turns_fast(model, run)
        if size == rest and not fast and is_quiet(model, size, step):
            run.step_size = max(run.step_size, 2.0 * size)
            _count_quiet_step(run)
            return size
        error, roots = step_error(model, size, step), method_of(model, step).roots
        if error <= 1.0 and fast:
            error = max(error, _ledger_error(model, run, size))
        is_raised = sticks and not error <= QUIET and _raise_order(model, run)
        if error <= 1.0:
            growth = min(MAX_GROWTH, 0.9 / root(max(error, 1e-10), roots))
            if not is_raised and (size < rest or growth < 1.0 or size * growth > h):
                run.step_size = size * growth
            return size
        if is_raised:
            continue
        shrink = max(0.2, 0.9 / root(error, roots)) if error < np.inf else 0.1
        h = size * shrink
        if h < LEAST_STEP * max(1.0, now) and h < rest:
            return 0.0


@compiled
def _raise_order(model: Record, run: Record) -> bool:
    """Selects the method of the next higher order; False if there is none."""
    run.quiet_steps = 0
    if run.rank + 1 == model.num_methods:
        return False
    run.rank += 1
    return True


@compiled
def _count_quiet_step(run: Record) -> None:
    """Selects the next lower order after many consecutive quiet steps."""
    run.quiet_steps += 1
    if run.quiet_steps >= QUIET_STEPS and run.rank > 0:
        run.quiet_steps = 0
        run.rank -= 1


@compiled
def _turns_fast(model: Record, run: Record) -> bool:
    """True if the object or a joint rotates fast at the end of the step, as near singular poses.

    The kinetic energy is then more sensitive than the tolerances of the coordinates cover.
    """
    fastest = abs(float(run.step.end.x[velocity_at(ANGLE)]))
    for i in range(model.num_fingers):
        for joint in range(2):
            fastest = max(fastest, abs(float(run.work.kin.joint_velocities[i, joint])))
    return fastest > FAST_RATE


@compiled
def _ledger_error(model: Record, run: Record, h: float) -> float:
    """Energy imbalance at the midpoint and end of a step, relative to the tolerance; the larger."""
    step = run.step
    start, _ = _balance_at(model, run, step.start)
    prepare_interpolant(model, run.discrete, run.now, h, step, run.work)
    interpolate(model, step, 0.5, step.stage)
    middle, _ = _balance_at(model, run, step.stage)
    # Last, so that ``work`` has the forces at the end of the step.
    flow(model, run.discrete, run.now + h, step.end, run.selection.derivative, run.work)
    end, kinetic = _balance_at(model, run, step.end)
    allowed = allowed_imbalance(model.numerics, kinetic, step.end.x[supplied_at(model)])
    return max(abs(end - start), abs(middle - start)) / allowed


@compiled
def _balance_at(model: Record, run: Record, state: Record) -> tuple[float, float]:
    """The energies that the ledger compares, and the kinetic energy [J]."""
    update_mechanics(model, state, run.work)
    return _balance(model, state, run.work.kin)


@compiled
def _step_to(model: Record, run: Record, h: float) -> None:
    """Repeats the step with another size."""
    take_step(model, run.discrete, run.now, h, run.step, run.work)


@compiled
def _size_of_zero(low: float, high: float) -> float:
    """Value below which a guard counts as zero, from its values at the ends of the bracket."""
    return min(LOCATION_SHARE * max(abs(low), abs(high)), LARGEST_ZERO)


@compiled
def _finish_location(model: Record, run: Record, low: float, high: float) -> None:
    """Takes the step to the event; if the law jumps there, stores the state before it."""
    if run.guards.fired[run.guards.count - 1] == 1:
        # The row before a jump of the law shows the state just before it.
        _step_to(model, run, low)
        run.location_error = step_error(model, low, run.step)
        run.before_time = run.now + low
        for k in range(model.num_states):
            run.before.x[k] = run.step.end.x[k]
        _step_to(model, run, high)
    else:
        _step_to(model, run, high)
        run.location_error = step_error(model, high, run.step)


locate = make_locate(
    LAYOUTS,
    step_to=_step_to,
    least_fired=least_fired,
    is_past_band=is_past_band,
    keep_first_fired=keep_first_fired,
    size_of_zero=_size_of_zero,
    finish=_finish_location,
    bisect_every=8,
)


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64)
def emit_inside(model: Record, run: Record, outlet: Record, h: float) -> None:
    """Stores rows at the output times inside the step just taken; the step does not depend on them.

    The rows are interpolated. Once the interpolant is past an event, each row is a shorter step of
    the method, and the step itself is repeated at the end.
    """
    step, end, t = run.step, run.now + h, next_output(model, run)
    if t >= end - OUTPUT_ROUNDING:
        return
    prepare_interpolant(model, run.discrete, run.now, h, step, run.work)
    lost, is_good = dissipated_at(model), True
    least, most = float(step.start.x[lost]), float(step.end.x[lost])
    while t < end - OUTPUT_ROUNDING:
        if is_good:
            interpolate(model, step, (t - run.now) / h, step.stage)
            least = _set_between(step.stage, lost, least, most)
            is_good = _agrees_with_phases(model, run, t)
        if is_good:
            store_row(model, run, outlet)
        else:
            take_step(model, run.discrete, run.now, t - run.now, step, run.work)
            least = _set_between(step.end, lost, least, most)
            emit_or_end(model, run, outlet, run.discrete, t, step.end, t)
        run.outputs += 1
        t = next_output(model, run)
    if not is_good:
        take_step(model, run.discrete, run.now, h, step, run.work)


@compiled
def _set_between(state: Record, j: int, least: float, most: float) -> float:
    """Limits coordinate ``j``, which never decreases in a step, to its range; returns it.

    At kinks of the law, states inside a step are less accurate than its end.
    """
    state.x[j] = max(least, min(most, state.x[j]))
    return float(state.x[j])


@compiled
def _agrees_with_phases(model: Record, run: Record, t: float) -> bool:
    """Evaluates the state inside the step; False if it is past an event or not finite."""
    if evaluate_at(model, run, run.discrete, t, run.step.stage) == 0:
        return False
    return is_past_event(model, run.discrete, run.row.state, run.work, run.guards) == 0


@compiled
def _goes_on(model: Record, run: Record) -> bool:
    """True if the velocities are continuous at the located event.

    Only checked at jumps of the law, where a step that acts too long beyond the jump changes them.
    """
    if run.guards.fired[run.guards.count - 1] == 0:
        return True
    n, relative = model.num_fingers, model.numerics.relative_tolerance
    for k in range(count_coordinates(n)):
        at = velocity_at(k) if k < 3 else slip_velocity_at(n, k - 3)
        before, after = run.before.x[at], run.step.end.x[at]
        if not abs(after - before) <= VELOCITY_JUMP + relative * abs(before):
            return False
    return True


@compiled
def _is_at_pole(model: Record, run: Record) -> bool:
    """True if a normal force has changed its sign through infinity instead of zero."""
    guards = run.guards
    for i in range(model.num_fingers):
        j = PER_CONTACT * i + NORMAL_FORCE
        if guards.fired[j] == 1 and guards.values[j] < -POLE:
            return True
    return False


@compiled
def _come_nearer(model: Record, run: Record, size: float) -> float:
    """Takes a step up to the jump of the law, so that the next, much shorter step crosses it.

    Returns:
        Size of the step; 0 if no step is short enough because forces grow without bound.
    """
    run.step_size = CROSSING * size
    run.fired = AT_POLE
    if run.step_size < LEAST_STEP * max(1.0, run.now):
        return 0.0
    near = run.before_time - run.now
    if near > 0.0:
        take_step(model, run.discrete, run.now, near, run.step, run.work)
        return near
    return take_accepted_step(model, run, run.now + run.step_size)


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def cut_at_event(model: Record, run: Record, h: float) -> float:
    """Shortens the step just taken to its first event; returns its size and sets ``run.fired``."""
    size = h
    for _ in range(MAX_CUTS):
        run.fired = find_fired(model, run.discrete, run.step.end, run.work, run.guards)
        if run.fired == 1:
            size = locate(model, run, size)
            # A guard above its level at the end of the full step may have fired before this event.
            while size > 0.0 and find_overlooked(model, run.discrete, run.guards) == 1:
                size = locate(model, run, size)
            if not _goes_on(model, run):
                size = _come_nearer(model, run, size)
                if size > 0.0:
                    continue
                return 0.0
            at_pole = _is_at_pole(model, run)
            if at_pole and size < LEAST_STEP * max(1.0, run.now):
                run.fired = AT_POLE
                return 0.0
            if size > 0.0 and (at_pole or not run.location_error <= ROUGH):
                # The step to the event is not smooth: the event is not reliable yet.
                run.step_size = 0.5 * size
                size = take_accepted_step(model, run, run.now + 0.5 * size)
                if size > 0.0:
                    continue
                run.fired = 0
                return 0.0
        dip = find_dip(model, run, size) if size > 0.0 else 0.0
        if dip == 0.0:
            break
        # A guard is past its level at this instant, although not at the end of the step.
        take_step(model, run.discrete, run.now, dip, run.step, run.work)
        size = dip
    if run.fired == 0:
        pass_step(model, run.discrete, run.guards)
    return size
