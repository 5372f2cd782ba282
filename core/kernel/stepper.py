"""One step of the Dormand-Prince 5(4) method, its error, and values inside the step.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.flow import flow
from core.kernel.records import MAX_STATE, Floats, Record

_NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_MATRIX = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
_ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
_DENSE = np.array(
    [
        -12715105075 / 11282082432,
        0.0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ]
)


# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("start", np.float64, (MAX_STATE,)),
        ("end", np.float64, (MAX_STATE,)),
        ("slopes", np.float64, (7, MAX_STATE)),  # the first at the start, the last at the end
        ("stage", np.float64, (MAX_STATE,)),
    ],
    align=True,
)


@compiled
def take_step(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``end`` and ``slopes``; ``work`` is left at the end of the step."""
    size = model.num_states
    for stage in range(1, 7):
        target = step.stage if stage < 6 else step.end
        for j in range(size):
            total = 0.0
            for k in range(stage):
                total += _MATRIX[stage, k] * step.slopes[k, j]
            target[j] = step.start[j] + h * total
        flow(model, discrete, t + _NODES[stage] * h, target, step.slopes[stage], work)


@compiled
def step_error(step: Record, size: int, h: float, relative: float, absolute: float) -> float:
    """Error of a step over what is allowed, root mean square; not a number if anything is not."""
    total = 0.0
    for j in range(size):
        error = 0.0
        for k in range(7):
            error += _ERROR[k] * step.slopes[k, j]
        scale = absolute + relative * max(abs(step.start[j]), abs(step.end[j]))
        total += (h * error / scale) ** 2
    return np.sqrt(total / size)


@compiled
def interpolate(step: Record, size: int, h: float, fraction: float, state: Floats) -> None:
    """State inside the step (continuous extension of order 4)."""
    rest = 1.0 - fraction
    for j in range(size):
        difference = step.end[j] - step.start[j]
        first = h * step.slopes[0, j] - difference
        second = difference - h * step.slopes[6, j] - first
        third = 0.0
        for k in range(7):
            third += _DENSE[k] * step.slopes[k, j]
        inner = second + rest * h * third
        state[j] = step.start[j] + fraction * (difference + rest * (first + fraction * inner))
