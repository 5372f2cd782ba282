"""Steps within tolerance, cut at the first event in them, and the rows inside them."""

from __future__ import annotations

import numpy as np
from numba import types

from core.kernel.compiler import compiled_apart
from core.kernel.guards import (
    find_fired,
    find_overlooked,
    is_past_event,
    keep_first_fired,
    least_fired,
    rearm_guards,
)
from core.kernel.model import MODEL
from core.kernel.records import Record
from core.kernel.run import (
    OUTLET,
    OUTPUT_ROUNDING,
    PROGRESS,
    ROWS_PER_STEP,
    emit,
    evaluate_at,
    store_row,
)
from core.kernel.stepper import interpolate, prepare_interpolant, take_step

LEAST_STEP = 1e-13
MAX_GROWTH = 10.0
LOCATION_WIDTH = 2e-14
LOCATION_SHARE = 1e-13


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def take_accepted_step(model: Record, run: Record, until: float) -> float:
    """Takes one step within tolerance, not past ``until``; its size, 0 if none is small enough."""
    numerics, now = model.numerics, run.now
    rest = until - now
    h = min(run.step_size, numerics.max_step, ROWS_PER_STEP / numerics.output_rate)
    exponent = model.method.exponent
    while True:
        size = rest if h >= rest * (1.0 - 1e-9) else h
        error = take_step(model, run.discrete, now, size, run.step, run.work)
        run.steps += 1
        if error <= 1.0:
            growth = min(MAX_GROWTH, 0.9 * max(error, 1e-10) ** -exponent)
            if size < rest or growth < 1.0 or size * growth > h:
                run.step_size = size * growth
            return size
        shrink = max(0.2, 0.9 * error**-exponent) if error < np.inf else 0.1
        h = size * shrink
        if h < LEAST_STEP * max(1.0, now) and h < rest:
            return 0.0


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def locate(model: Record, run: Record, h: float) -> float:
    """Size of the step at whose end the first of the fired guards is at its level.

    The step is taken again at every trial, so that the root is that of the method itself
    and not of an interpolant. Regula falsi (Illinois) with bisection as a safeguard.
    """
    now, discrete, step, work, guards = run.now, run.discrete, run.step, run.work, run.guards
    low, high, at = 0.0, h, 0.0
    value_high = least_fired(model, discrete, step.end, work, guards)
    take_step(model, discrete, now, low, step, work)
    value_low = least_fired(model, discrete, step.end, work, guards)
    width = LOCATION_WIDTH * max(1.0, now)
    nothing = LOCATION_SHARE * max(abs(value_low), abs(value_high))
    side = 0
    for trial in range(100):
        if value_low <= 0.0 or high - low <= width:
            break
        at = (low * value_high - high * value_low) / (value_high - value_low)
        if not low < at < high or trial % 8 == 7:
            at = 0.5 * (low + high)
        take_step(model, discrete, now, at, step, work)
        value = least_fired(model, discrete, step.end, work, guards)
        if abs(value) <= nothing:
            high = at
            break
        if value > 0.0:
            low, value_low = at, value
            value_high *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            high, value_high = at, value
            value_low *= 0.5 if side == -1 else 1.0
            side = -1
    if value_low <= 0.0:
        high = 0.0
    if at != high:
        take_step(model, discrete, now, high, step, work)
    keep_first_fired(guards, least_fired(model, discrete, step.end, work, guards))
    return high


@compiled_apart(types.float64, MODEL, PROGRESS, OUTLET, types.float64)
def emit_inside(model: Record, run: Record, outlet: Record, h: float) -> float:
    """Rows at the output times from the start of the step to before its end.

    Returns:
        How much of the step agrees with its phases: ``h``, or where a row shows a guard that
        has fired although it is quiet again at the end, the way to that row, not written.
    """
    now, end, prepared = run.now, run.now + h, False
    while True:
        t = run.outputs / model.numerics.output_rate
        if t >= end - OUTPUT_ROUNDING:
            return h
        if t <= now or h == 0.0:
            emit(model, run, outlet, t, run.step.start)
        else:
            if not prepared:
                prepare_interpolant(model, run.discrete, now, h, run.step, run.work)
                prepared = True
            interpolate(model, run.step, (t - now) / h, run.step.stage)
            if evaluate_at(model, run, t, run.step.stage) == 1:
                if is_past_event(model, run.discrete, run.row.state, run.work, run.guards) == 1:
                    return t - now
                store_row(model, run, outlet)
        run.outputs += 1


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def cut_at_event(model: Record, run: Record, h: float) -> float:
    """The step just taken, cut at the first event in it; ``run.fired`` tells whether there is."""
    if find_fired(model, run.discrete, run.step.end, run.work, run.guards) == 1:
        run.fired = 1
        size = locate(model, run, h)
        # What is quiet again at the end of the whole step may have fired before this event.
        while size > 0.0 and find_overlooked(model, run.discrete, run.work, run.guards) == 1:
            size = locate(model, run, size)
        return size
    run.fired = 0
    rearm_guards(model, run.discrete, run.work, run.guards)
    return h
