"""States at the stages of a step, and states inside it."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.methods import method_of


@compiled
def set_stage(model: Record, row: int, h: float, step: Record, target: Record) -> None:
    """Computes the state at stage ``row``."""
    size, matrix = model.num_states, method_of(model, step).matrix
    for j in range(size):
        target.x[j] = step.start.x[j]
    for k in range(row):
        weight = h * matrix[row, k]
        if weight != 0.0:
            for j in range(size):
                target.x[j] += weight * step.slopes[k].x[j]


@compiled
def weigh_slopes(weights: Floats, count: int, size: int, step: Record, total: Floats) -> None:
    """Computes the weighted sum of the first ``count`` slopes."""
    for j in range(size):
        total[j] = 0.0
    for k in range(count):
        weight = weights[k]
        if weight != 0.0:
            for j in range(size):
                total[j] += weight * step.slopes[k].x[j]


@compiled
def fill_terms(model: Record, h: float, step: Record) -> None:
    """Fills ``terms`` from all slopes, including those used only by the interpolant."""
    size, method = model.num_states, method_of(model, step)
    for j in range(size):
        difference = step.end.x[j] - step.start.x[j]
        first, last = h * step.slopes[0].x[j], h * step.slopes[method.last].x[j]
        step.terms[0, j] = difference
        step.terms[1, j] = first - difference
        step.terms[2, j] = 2.0 * difference - first - last
    for term in range(method.num_dense):
        weigh_slopes(method.dense[term], method.num_slopes, size, step, step.terms[3 + term])
        for j in range(size):
            step.terms[3 + term, j] *= h


@compiled
def interpolate(model: Record, step: Record, fraction: float, state: Record) -> None:
    """Computes a state inside the step from the dense output of the method."""
    size, last = model.num_states, method_of(model, step).num_dense + 2
    for j in range(size):
        state.x[j] = 0.0
    for term in range(last, -1, -1):
        factor = fraction if term % 2 == 0 else 1.0 - fraction
        for j in range(size):
            state.x[j] = factor * (state.x[j] + step.terms[term, j])
    for j in range(size):
        state.x[j] += step.start.x[j]
