"""Coefficients of explicit Runge-Kutta methods, and methods for short steps.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4 to II.6.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record

MAX_METHODS = 3
MAX_SLOPES = 16
DENSE_ROWS = 4

# A method. Slope 0 is at the start, slope ``last`` at the end of the step; later slopes are used
# only by the interpolant.
METHOD = np.dtype(
    [
        ("last", np.int64),
        ("num_slopes", np.int64),
        ("num_dense", np.int64),  # rows of ``dense``
        ("roots", np.int64),  # exponent of the error in the step size: -1 / 2^roots
        ("nodes", np.float64, (MAX_SLOPES,)),
        ("num_ordered", np.int64),
        ("ordered", np.int64, (MAX_SLOPES,)),  # slopes at distinct nodes, from start to end
        ("matrix", np.float64, (MAX_SLOPES, MAX_SLOPES)),
        ("error", np.float64, (MAX_SLOPES,)),
        ("correction", np.float64, (MAX_SLOPES,)),  # a second error of lower order; 0 if none
        ("dense", np.float64, (DENSE_ROWS, MAX_SLOPES)),  # of the interpolant from term 3 on
    ],
    align=True,
)

Sparse = Sequence[Sequence[tuple[int, float]]]


def pack_method(
    roots: int,
    last: int,
    nodes: Sequence[float],
    matrix: Sparse,
    error: Sequence[float],
    correction: Sequence[float],
    dense: Sparse,
) -> np.void:
    """Creates a `METHOD` from its coefficients.

    Args:
        roots: Exponent of the error in the step size: -1 / 2^roots.
        last: Index of the slope at the end of the step.
        nodes: One per slope, including those of the interpolant.
        matrix: Nonzero (column, coefficient) pairs per slope.
        error: Weights of the slopes in the error.
        correction: Weights of the slopes in a second error of lower order; empty if none.
        dense: Per term of the interpolant from the third on, like ``matrix``.
    """
    packed = np.zeros(1, METHOD)
    method: np.void = packed[0]
    method["last"], method["num_slopes"], method["num_dense"] = last, len(nodes), len(dense)
    method["roots"] = roots
    method["nodes"][: len(nodes)] = nodes
    inside = {node: k for k, node in enumerate(nodes[:last]) if node < 1.0}
    ordered = [*(inside[node] for node in sorted(inside)), last]
    method["num_ordered"] = len(ordered)
    method["ordered"][: len(ordered)] = ordered
    method["error"][: len(error)] = error
    method["correction"][: len(correction)] = correction
    for name, rows in (("matrix", matrix), ("dense", dense)):
        for row, entries in enumerate(rows):
            for column, value in entries:
                method[name][row, column] = value
    return method


# Bogacki and Shampine, A 3(2) pair of Runge-Kutta formulas, Applied Mathematics Letters 2 (1989):
# three evaluations per step.
BS32 = pack_method(
    roots=2,
    last=3,
    nodes=(0.0, 1 / 2, 3 / 4, 1.0),
    matrix=(
        (),
        ((0, 1 / 2),),
        ((1, 3 / 4),),
        ((0, 2 / 9), (1, 1 / 3), (2, 4 / 9)),
    ),
    error=(-5 / 72, 1 / 12, 1 / 9, -1 / 8),
    correction=(),
    dense=(),
)

# The classical method of order 4, four evaluations per step. The embedded method of order 3 moves a
# part of the last weight to the slope at the end of the step; any part preserves order 3.
RK43 = pack_method(
    roots=2,
    last=4,
    nodes=(0.0, 1 / 2, 1 / 2, 1.0, 1.0),
    matrix=(
        (),
        ((0, 1 / 2),),
        ((1, 1 / 2),),
        ((2, 1.0),),
        ((0, 1 / 6), (1, 1 / 3), (2, 1 / 3), (3, 1 / 6)),
    ),
    error=(0.0, 0.0, 0.0, 1 / 10, -1 / 10),
    correction=(),
    dense=(),
)

# Dormand and Prince, order 5(4): six evaluations per step.
DOPRI5 = pack_method(
    roots=2,
    last=6,
    nodes=(0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0),
    matrix=(
        (),
        ((0, 1 / 5),),
        ((0, 3 / 40), (1, 9 / 40)),
        ((0, 44 / 45), (1, -56 / 15), (2, 32 / 9)),
        ((0, 19372 / 6561), (1, -25360 / 2187), (2, 64448 / 6561), (3, -212 / 729)),
        (
            (0, 9017 / 3168),
            (1, -355 / 33),
            (2, 46732 / 5247),
            (3, 49 / 176),
            (4, -5103 / 18656),
        ),
        ((0, 35 / 384), (2, 500 / 1113), (3, 125 / 192), (4, -2187 / 6784), (5, 11 / 84)),
    ),
    error=(71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40),
    correction=(),
    dense=(
        (
            (0, -12715105075 / 11282082432),
            (2, 87487479700 / 32700410799),
            (3, -10690763975 / 1880347072),
            (4, 701980252875 / 199316789632),
            (5, -1453857185 / 822651844),
            (6, 69997945 / 29380423),
        ),
    ),
)


@compiled
def method_of(model: Record, step: Record) -> Record:
    """Method of a step."""
    return model.methods[step.rank]
