"""The hybrid loop in resumable pieces: flow, detect, locate, jump."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.guards import (
    FACE,
    NORMAL_FORCE,
    PER_CONTACT,
    PHASE,
    SINGULAR,
    find_fired,
    num_guards,
    rearm_guards,
    update_guards,
)
from core.kernel.jump import (
    CHATTERING,
    LEFT_FACE,
    MAX_STEPS,
    PAINLEVE,
    REACHED,
    RUNNING,
    SEPARATED,
    STEP_UNDERFLOW,
    begin_stretch,
    change_phases,
    control_tick,
    finish_jump,
    next_tick,
    recognise,
    restart_flow,
    settle,
)
from core.kernel.jump import SINGULAR as FINGER_SINGULAR
from core.kernel.model import NUM_PIECES
from core.kernel.records import Record
from core.kernel.run import (
    CHANGE_CAPACITY,
    OUTPUT_ROUNDING,
    ROOM_TO_SPARE,
    ROWS_BEFORE_PAUSE,
    Outlet,
    emit,
    keep_old,
)
from core.kernel.stepper import interpolate, step_error, take_step

LEAST_STEP = 1e-13
STALLED = 1e-9
MAX_STALLS = 20
LOCATION_WIDTH = 2e-14


@compiled
def advance(
    model: Record,
    run: Record,
    outlet: Outlet,
    t_stop: float,
    first: bool,
    same_ticks: bool,
    max_steps: int,
) -> int:
    """Advances the run by at most ``max_steps`` steps, at most to ``t_stop``.

    Args:
        model: Constants up to ``t_stop``.
        run: The run.
        outlet: Buffers for rows and phase changes that the caller empties.
        t_stop: End of the run, or the next timed change [s].
        first: Whether the run starts with this stretch.
        same_ticks: Whether sampled control keeps its ticks from the stretch before.
        max_steps: Budget, so that a call stays short.

    Returns:
        RUNNING to be called again, REACHED at ``t_stop``, else why the run ended.
    """
    if not run.begun:
        status = begin_stretch(model, run, outlet, first, same_ticks)
        if status != RUNNING:
            return status
    for _ in range(max_steps):
        if run.num_rows > ROWS_BEFORE_PAUSE:
            return RUNNING
        if run.num_changes > CHANGE_CAPACITY - ROOM_TO_SPARE:
            return RUNNING
        if run.now >= t_stop:
            emit(model, run, outlet, t_stop, run.step.start)
            return REACHED
        if run.steps >= model.numerics.max_steps:
            emit(model, run, outlet, run.now, run.step.start)
            return MAX_STEPS
        status = _advance_once(model, run, outlet, t_stop)
        if status != RUNNING:
            return status
    return RUNNING


@compiled
def _next_break(model: Record, run: Record, t_stop: float) -> float:
    """The next instant at which the flow is not smooth for a known reason."""
    piece = run.discrete.piece
    until = min(t_stop, run.hold_until)
    if piece < NUM_PIECES:
        until = min(until, model.motion.breaks[piece])
    if model.law.period > 0.0:
        until = min(until, next_tick(model, run))
    return until


@compiled
def _advance_once(model: Record, run: Record, outlet: Outlet, t_stop: float) -> int:
    """One step, cut at the first event in it, and the jump at its end if there is one."""
    now = run.now
    until = _next_break(model, run, t_stop)
    if until > now:
        h, reaches = _take_accepted_step(model, run, outlet, until)
        if h == 0.0:
            emit(model, run, outlet, now, run.step.start)
            return STEP_UNDERFLOW
        update_guards(model, run.discrete, run.step.end, run.work, run.guards)
        event = find_fired(model, run.discrete, run.work, run.guards, run.levels, run.fired)
        if event:
            h = _locate(model, run, outlet, h)
            reaches = False
        else:
            rearm_guards(model, run.discrete, run.work, run.guards, run.levels)
        end = until if reaches else now + h
        _emit_inside(model, run, outlet, h, end)
        run.step.start[:] = run.step.end
        run.step.slopes[0, :] = run.step.slopes[6]
        run.now = end
        if event:
            return _pass_event(model, run, outlet)
        if not reaches:
            return RUNNING
    return _pass_break(model, run, outlet, t_stop)


@compiled
def _take_accepted_step(
    model: Record, run: Record, outlet: Outlet, until: float
) -> tuple[float, bool]:
    """Takes one step within tolerance; returns its size (0 if none is small enough)."""
    numerics, now = model.numerics, run.now
    rest = until - now
    h = min(run.step_size, numerics.max_step)
    while True:
        reaches = h >= rest * (1.0 - 1e-9)
        size = rest if reaches else h
        take_step(model, run.discrete, now, size, run.step, run.work)
        run.steps += 1
        error = step_error(
            run.step,
            model.num_states,
            size,
            numerics.relative_tolerance,
            numerics.absolute_tolerance,
        )
        if error <= 1.0:
            growth = min(5.0, 0.9 * max(error, 1e-10) ** -0.2)
            if not reaches or growth < 1.0 or size * growth > h:
                run.step_size = size * growth
            return size, reaches
        shrink = max(0.2, 0.9 * error**-0.2) if error < np.inf else 0.1
        h = size * shrink
        if h < LEAST_STEP * max(1.0, now) and h < rest:
            return 0.0, False


@compiled
def _locate(model: Record, run: Record, outlet: Outlet, h: float) -> float:
    """Size of the step at whose end the first of the fired guards is at its level.

    The step is taken again at every trial, so that the root is that of the method itself
    and not of an interpolant. Regula falsi (Illinois) with bisection as a safeguard.
    """
    now = run.now
    low, high = 0.0, h
    value_high = _least_fired(model, run)
    take_step(model, run.discrete, now, 0.0, run.step, run.work)
    update_guards(model, run.discrete, run.step.end, run.work, run.guards)
    value_low = _least_fired(model, run)
    width = LOCATION_WIDTH * max(1.0, now)
    side = 0
    for trial in range(100):
        if value_low <= 0.0 or high - low <= width:
            break
        middle = (low * value_high - high * value_low) / (value_high - value_low)
        if not low < middle < high or trial % 8 == 7:
            middle = 0.5 * (low + high)
        take_step(model, run.discrete, now, middle, run.step, run.work)
        update_guards(model, run.discrete, run.step.end, run.work, run.guards)
        value = _least_fired(model, run)
        if value > 0.0:
            low, value_low = middle, value
            value_high *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            high, value_high = middle, value
            value_low *= 0.5 if side == -1 else 1.0
            side = -1
    if value_low <= 0.0:
        high = 0.0
    take_step(model, run.discrete, now, high, run.step, run.work)
    update_guards(model, run.discrete, run.step.end, run.work, run.guards)
    _keep_first_fired(model, run)
    return high


@compiled
def _least_fired(model: Record, run: Record) -> float:
    """The least distance to its level among the guards that fired in this step."""
    least = np.inf
    for j in range(num_guards(model)):
        if run.fired[j] == 1:
            least = min(least, run.guards[j] - run.levels[j])
    return least


@compiled
def _keep_first_fired(model: Record, run: Record) -> None:
    """Of the fired guards keeps those at their level here; the others would come later."""
    least = _least_fired(model, run)
    for j in range(num_guards(model)):
        if run.guards[j] - run.levels[j] > max(0.0, least):
            run.fired[j] = 0


@compiled
def _emit_inside(model: Record, run: Record, outlet: Outlet, h: float, end: float) -> None:
    """Rows at the output times from the start of the step to before its end."""
    now = run.now
    while True:
        t = run.outputs / model.numerics.output_rate
        if t >= end - OUTPUT_ROUNDING:
            return
        if t <= now or h == 0.0:
            run.scratch[:] = run.step.start
        else:
            interpolate(run.step, model.num_states, h, (t - now) / h, run.scratch)
        emit(model, run, outlet, t, run.scratch)
        run.outputs += 1


@compiled
def _pass_break(model: Record, run: Record, outlet: Outlet, t_stop: float) -> int:
    """The jump at an instant known beforehand; one kind at a time, the rest follow at once."""
    now = run.now
    if now >= t_stop:
        return RUNNING
    piece = run.discrete.piece
    if piece < NUM_PIECES and model.motion.breaks[piece] <= now:
        return _change_piece(model, run, outlet)
    if model.law.period > 0.0 and next_tick(model, run) <= now:
        return control_tick(model, run, outlet)
    if run.hold_until <= now:
        return recognise(model, run, outlet)
    return RUNNING


@compiled
def _change_piece(model: Record, run: Record, outlet: Outlet) -> int:
    """The desired acceleration jumps; under sampled control it is seen at the next tick."""
    breaks = model.motion.breaks
    if model.law.period > 0.0:
        run.discrete.piece += 1
        return RUNNING
    keep_old(run)
    emit(model, run, outlet, run.now, run.step.start)
    run.discrete.piece += 1
    while run.discrete.piece < NUM_PIECES and (breaks[run.discrete.piece] <= run.now):
        run.discrete.piece += 1
    return finish_jump(model, run, outlet, settle(model, run, outlet, True))


@compiled
def _pass_event(model: Record, run: Record, outlet: Outlet) -> int:
    """What the guards that fired mean: the end of the run, another phase, or a bound reached."""
    now = run.now
    run.stalls = run.stalls + 1 if now - run.last_event < STALLED else 0
    run.last_event = now
    status = _find_end(model, run)
    if status == RUNNING and run.stalls > MAX_STALLS:
        status = CHATTERING
    if status != RUNNING:
        emit(model, run, outlet, now, run.step.start)
        return status
    n = model.num_fingers
    for i in range(n):
        if run.fired[PER_CONTACT * i + PHASE] == 1:
            if run.discrete.phases[i] != 0:
                run.step.start[6 + n + i] = 0.0
            run.concerned = i
            return change_phases(model, run, outlet)
    restart_flow(model, run, outlet)
    return RUNNING


@compiled
def _find_end(model: Record, run: Record) -> int:
    """Whether a fired guard ends the run, and which contact or finger is concerned."""
    n = model.num_fingers
    for i in range(n):
        base = PER_CONTACT * i
        status = RUNNING
        if run.fired[base + NORMAL_FORCE] == 1:
            status = SEPARATED
        elif run.fired[base + FACE] == 1:
            status = LEFT_FACE
        elif run.fired[base + SINGULAR] == 1:
            status = FINGER_SINGULAR
        if status != RUNNING:
            run.concerned = i
            return status
    if run.fired[PER_CONTACT * n] == 1:
        return PAINLEVE
    return RUNNING
