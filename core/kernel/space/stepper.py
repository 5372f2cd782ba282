"""One step of an explicit Runge-Kutta method in space, its error and its largest size.

The direction of a slow slip is stiff: it relaxes at the rate mu F_n / (m |s'|), and a step that
passed |s'| = 0 would never know. So no step is longer than a share of the time in which a slip
would stop, and slip velocities have a tolerance of their own.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.methods import MAX_SLOPES
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.space.flow import flow, slip_speed
from slipgrasp.core.kernel.space.model import MODEL
from slipgrasp.core.kernel.space.selection import normalise
from slipgrasp.core.kernel.space.state import STATE, slip_velocity_at
from slipgrasp.core.kernel.space.workspace import DISCRETE, STICK, WORKSPACE

SLIP_TOLERANCE = 1e-11  # absolute, of slip velocities [m/s]
STOP_SHARE = 0.6  # of the time in which a slip would stop
SHORT_STEP, LONG_STEP = 1e-6, 2e-5  # while a slip has just begun [s]
BRISK = 0.1  # [m/s^2]

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("rank", np.int64),  # of the method by which it is taken
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STEP, WORKSPACE)
def spatial_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> None:
    """Fills ``end`` and ``slopes``; ``work`` is left at the end of the step."""
    method, size = model.methods[step.rank], model.num_states
    for row in range(1, method.last + 1):
        for j in range(size):
            step.end.x[j] = step.start.x[j]
        for k in range(row):
            weight = h * method.matrix[row, k]
            if weight != 0.0:
                for j in range(size):
                    step.end.x[j] += weight * step.slopes[k].x[j]
        normalise(step.end)
        flow(model, discrete, step.end, step.slopes[row], work)


@compiled_apart(types.float64, MODEL, types.float64, STEP)
def spatial_error(model: Record, h: float, step: Record) -> float:
    """The error of a step over what is allowed, root mean square; NaN if anything is not finite."""
    method, size, n = model.methods[step.rank], model.num_states, model.num_fingers
    relative, absolute = model.numerics.relative_tolerance, model.numerics.absolute_tolerance
    first, last = slip_velocity_at(n, 0, 0), slip_velocity_at(n, n, 0)
    total = 0.0
    for j in range(size):
        error = 0.0
        for k in range(method.last + 1):
            error += method.error[k] * step.slopes[k].x[j]
        if first <= j < last:
            i = (j - first) // 2
            largest = max(slip_speed(n, step.start, i), slip_speed(n, step.end, i))
            scale = min(absolute, SLIP_TOLERANCE) + relative * largest
        else:
            largest = max(abs(step.start.x[j]), abs(step.end.x[j]))
            scale = absolute + relative * largest
        total += square(h * error / scale)
    return np.sqrt(total / size)


@compiled
def longest_step(model: Record, discrete: Record, step: Record) -> float:
    """The longest step that does not pass the end of a slip [s], inf if nothing slips."""
    n, longest = model.num_fingers, np.inf
    x, slope = step.start.x, step.slopes[0].x
    for i in range(n):
        if discrete.phases[i] == STICK:
            continue
        a0, a1 = slope[slip_velocity_at(n, i, 0)], slope[slip_velocity_at(n, i, 1)]
        if discrete.frozen[i] == 1:
            brisk = a0 * a0 + a1 * a1 > BRISK * BRISK
            longest = min(longest, SHORT_STEP if brisk else LONG_STEP)
            continue
        v0, v1 = x[slip_velocity_at(n, i, 0)], x[slip_velocity_at(n, i, 1)]
        power = v0 * a0 + v1 * a1
        if power < 0.0:
            longest = min(longest, STOP_SHARE * (v0 * v0 + v1 * v1) / -power)
    return longest


@compiled
def turns_back(model: Record, discrete: Record, step: Record) -> bool:
    """Whether a slip has passed zero within the step: its direction lies behind it then."""
    n, start, end = model.num_fingers, step.start.x, step.end.x
    for i in range(n):
        if discrete.phases[i] == STICK or discrete.frozen[i] == 1:
            continue
        a, b = slip_velocity_at(n, i, 0), slip_velocity_at(n, i, 1)
        if not start[a] * end[a] + start[b] * end[b] > 0.0:
            return True
    return False
