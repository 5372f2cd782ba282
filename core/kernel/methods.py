"""What an explicit Runge-Kutta method is to the stepper, and the cheaper of the two it has.

Reference: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 and II.6.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

MAX_SLOPES = 16
DENSE_ROWS = 4

# One method. Slope 0 is that at the start, slope ``last`` that at the end of the step; slopes
# after it are needed only for values inside the step.
METHOD = np.dtype(
    [
        ("last", np.int64),
        ("num_slopes", np.int64),
        ("num_dense", np.int64),  # rows of ``dense``
        ("roots", np.int64),  # the step size follows the error to the power -1 / 2^roots
        ("nodes", np.float64, (MAX_SLOPES,)),
        ("num_ordered", np.int64),
        ("ordered", np.int64, (MAX_SLOPES,)),  # slopes at different nodes, from start to end
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
    """One `METHOD` from its coefficients.

    Args:
        roots: Square roots of the error in the step size: its power is -1 / 2^roots.
        last: Number of the slope at the end of the step.
        nodes: One per slope, those for values inside the step included.
        matrix: Per slope, the (column, coefficient) pairs that are not zero.
        error: Weights of the slopes in the error.
        correction: Weights of the slopes in a second error of lower order; empty if none.
        dense: Per term of the interpolant from the third on, like ``matrix``.
    """
    packed = np.zeros(1, METHOD)
    method: np.void = packed[0]
    method["last"], method["num_slopes"], method["num_dense"] = last, len(nodes), len(dense)
    method["roots"] = roots
    method["nodes"][: len(nodes)] = nodes
    ordered = [*sorted((k for k in range(last) if nodes[k] < 1.0), key=nodes.__getitem__), last]
    method["num_ordered"] = len(ordered)
    method["ordered"][: len(ordered)] = ordered
    method["error"][: len(error)] = error
    method["correction"][: len(correction)] = correction
    for name, rows in (("matrix", matrix), ("dense", dense)):
        for row, entries in enumerate(rows):
            for column, value in entries:
                method[name][row, column] = value
    return method


# Dormand-Prince 5(4): six evaluations a step, cheapest for the short steps of sampled control.
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
