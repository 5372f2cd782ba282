"""Steps of a body on a support within tolerance, and its stops.

The direction of a slow slip is stiff: steps are limited to a fraction of the time to stop, so that
none passes |u| = 0. A step from a speed that counts as rest has the remaining time to stop as its
size, and ends at rest exactly.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import next_output
from slipgrasp.core.kernel.loop.progress import OUTPUT_ROUNDING
from slipgrasp.core.kernel.loop.stages import weigh_slopes
from slipgrasp.core.kernel.numerics.elementary import root, square
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.support.flow import (
    sliding_part,
    sliding_speed,
)
from slipgrasp.core.kernel.support.model import MODEL
from slipgrasp.core.kernel.support.run import (
    OUTLET,
    PROGRESS,
    emit_as_of,
    step_inside,
    support_step,
)
from slipgrasp.core.kernel.support.state import OMEGA, SLIP, VX, VY

REST_SPEED = 1e-10  # below which the next step ends at rest, if the body decelerates [m/s]
SPEED_TOLERANCE = 1e-11  # absolute [m/s]
STOP_SHARE = 0.6  # largest step relative to the time to stop
LEAST_STEP = 1e-14
MAX_GROWTH = 10.0
TURNED_BACK = 16.0  # error of a step whose sliding velocity changed its sign


@compiled
def _time_to_stop(model: Record, run: Record) -> float:
    """|u| / -|u|' at the start of the step [s]; inf if the body does not decelerate."""
    start, slope, speeds, powers = run.step.start, run.step.slopes[0], 0.0, 0.0
    for part in range(3):
        speed = sliding_part(model, start, part)
        speeds += square(speed)
        powers += speed * sliding_part(model, slope, part)
    return speeds / -powers if powers < 0.0 else np.inf


@compiled
def _step_to(model: Record, run: Record, h: float) -> None:
    """Takes a step of size ``h``."""
    support_step(model, run.discrete, h, run.step, run.work)


@compiled
def _error_of(model: Record, run: Record, h: float) -> float:
    """Root mean square error of a step relative to the tolerance."""
    step, numerics, size = run.step, model.numerics, model.num_states
    errors, radius = run.errors, model.hand.radius
    weigh_slopes(method_of(model, step).error, method_of(model, step).last + 1, size, step, errors)
    fastest = max(sliding_speed(model, step.start), sliding_speed(model, step.end))
    slow = min(numerics.absolute_tolerance, SPEED_TOLERANCE)
    total = 0.0
    for k in range(size):
        error, largest = h * errors[k], max(abs(step.start.x[k]), abs(step.end.x[k]))
        scale = numerics.absolute_tolerance + numerics.relative_tolerance * largest
        if k in (VX, VY) or (k == OMEGA and radius > 0.0):
            error *= radius if k == OMEGA else 1.0
            scale = slow + numerics.relative_tolerance * fastest
        total += square(error / scale)
    along = 0.0
    for part in range(3):
        along += sliding_part(model, step.start, part) * sliding_part(model, step.end, part)
    if run.discrete.phases[0] == SLIP and along <= 0.0 < sliding_speed(model, step.start):
        return TURNED_BACK
    return np.sqrt(total / size)


@compiled
def _come_to_rest(model: Record, run: Record, h: float) -> None:
    """Takes the last step of a slip, which ends at rest; keeps its direction for the last row."""
    step, discrete, radius = run.step, run.discrete, model.hand.radius
    speed = sliding_speed(model, step.start)
    for part in range(3):
        discrete.direction[part] = sliding_part(model, step.start, part) / speed
    _step_to(model, run, h)
    step.end.x[VX] = step.end.x[VY] = 0.0
    if radius > 0.0:
        step.end.x[OMEGA] = 0.0
    run.fired = 1


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def support_accept(model: Record, run: Record, until: float) -> float:
    """Takes a step within tolerance, at most to ``until``; returns its size, 0 on failure."""
    rest, h = until - run.now, min(run.step_size, model.numerics.max_step)
    run.fired = 0
    if run.discrete.phases[0] == SLIP:
        to_stop = _time_to_stop(model, run)
        if to_stop <= rest and sliding_speed(model, run.step.start) < REST_SPEED:
            run.steps += 1
            _come_to_rest(model, run, to_stop)
            return to_stop
        h = min(h, STOP_SHARE * to_stop)
    while True:
        size = rest if h >= rest * (1.0 - 1e-9) else h
        _step_to(model, run, size)
        run.steps += 1
        error = _error_of(model, run, size)
        if error <= 1.0:
            grown = size * min(MAX_GROWTH, 0.9 / root(max(error, 1e-10), 2))
            run.step_size = max(grown, run.step_size) if grown >= size == rest else grown
            return size
        h = size * (max(0.2, 0.9 / root(error, 2)) if error < np.inf else 0.1)
        if h < LEAST_STEP * max(1.0, run.now) and h < rest:
            return 0.0


@compiled_apart(types.void, MODEL, PROGRESS, OUTLET, types.float64)
def support_emit_inside(model: Record, run: Record, outlet: Record, h: float) -> None:
    """Writes the rows at the output times inside the step just taken."""
    end = run.now + h
    while next_output(model, run) < end - OUTPUT_ROUNDING:
        t = next_output(model, run)
        step_inside(model, run, t - run.now)
        emit_as_of(model, run, outlet, run.discrete, t, run.inside.end, t)
        run.outputs += 1
