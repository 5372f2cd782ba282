"""One step of an explicit Runge-Kutta method, its error, and values inside the step.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4-II.6.
"""

from __future__ import annotations

import numpy as np
from numba import types

from core.kernel.compiler import compiled, compiled_apart
from core.kernel.flow import flow
from core.kernel.methods import DENSE_ROWS, MAX_SLOPES
from core.kernel.model import MODEL
from core.kernel.records import MAX_STATE, STATE, Record
from core.kernel.workspace import DISCRETE, WORKSPACE

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
        ("stage", STATE),
        ("terms", np.float64, (DENSE_ROWS + 3, MAX_STATE)),  # of the interpolant
    ],
    align=True,
)


@compiled
def _combine(model: Record, row: int, h: float, step: Record, target: Record) -> None:
    """The state at which slope ``row`` is taken."""
    size = model.num_states
    for j in range(size):
        target.x[j] = step.start.x[j]
    for k in range(row):
        weight = h * model.method.matrix[row, k]
        if weight != 0.0:
            for j in range(size):
                target.x[j] += weight * step.slopes[k].x[j]


@compiled_apart(types.float64, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE)
def take_step(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> float:
    """Fills ``end`` and ``slopes``; ``work`` is left at the end of the step.

    Returns:
        The error over what is allowed, root mean square; not a number if anything is not.
    """
    method = model.method
    for row in range(1, method.last + 1):
        _combine(model, row, h, step, step.end)
        flow(model, discrete, t + method.nodes[row] * h, step.end, step.slopes[row], work)
    relative, absolute = model.numerics.relative_tolerance, model.numerics.absolute_tolerance
    total, correction = 0.0, 0.0
    for j in range(model.num_states):
        error, other = 0.0, 0.0
        for k in range(method.last + 1):
            error += method.error[k] * step.slopes[k].x[j]
            other += method.correction[k] * step.slopes[k].x[j]
        scale = absolute + relative * max(abs(step.start.x[j]), abs(step.end.x[j]))
        total += (error / scale) ** 2
        correction += (other / scale) ** 2
    if total == 0.0:
        return 0.0
    return h * total / np.sqrt((total + 0.01 * correction) * model.num_states)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE)
def prepare_interpolant(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``terms`` for `interpolate`; ``work`` is left somewhere inside the step."""
    method = model.method
    for row in range(method.last + 1, method.num_slopes):
        _combine(model, row, h, step, step.stage)
        flow(model, discrete, t + method.nodes[row] * h, step.stage, step.slopes[row], work)
    for j in range(model.num_states):
        difference = step.end.x[j] - step.start.x[j]
        first, last = h * step.slopes[0].x[j], h * step.slopes[method.last].x[j]
        step.terms[0, j] = difference
        step.terms[1, j] = first - difference
        step.terms[2, j] = 2.0 * difference - first - last
        for term in range(method.num_dense):
            total = 0.0
            for k in range(method.num_slopes):
                total += method.dense[term, k] * step.slopes[k].x[j]
            step.terms[3 + term, j] = h * total


@compiled
def interpolate(model: Record, step: Record, fraction: float, state: Record) -> None:
    """State inside the step, by the continuous extension of the method."""
    for j in range(model.num_states):
        value = 0.0
        for term in range(model.method.num_dense + 2, -1, -1):
            factor = fraction if term % 2 == 0 else 1.0 - fraction
            value = factor * (value + step.terms[term, j])
        state.x[j] = step.start.x[j] + value
