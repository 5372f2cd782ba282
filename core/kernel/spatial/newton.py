"""Semi-smooth Newton method for the contact problem, with any number of rows per contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.numerics.dense import factor_dense, solve_dense
from slipgrasp.core.kernel.numerics.elementary import square

NEWTON_STEPS, FULL_STEPS, NEWTON_ERROR = 100, 30, 1e-12


def make_newton(rows: int, mobility: Any, set_rows: Any) -> Any:
    """Creates Newton's method for a contact problem; it returns 1 if it has converged.

    Args:
        rows: Number of rows per contact.
        mobility: Returns an entry of G.
        set_rows: Sets the rows of the matrix for a contact, and its negative residuals [N];
            receives the directions of slips in progress.
    """

    @compiled
    def newton(model: Record, directions: Floats, problem: Record) -> int:
        n = model.num_fingers
        size = rows * n
        for trial in range(NEWTON_STEPS):
            worst, scale = 0.0, 0.0
            for a in range(size):
                total = problem.offset[a]
                for b in range(size):
                    total += mobility(problem, a, b) * problem.force[b]
                problem.opening[a] = total
                scale += square(problem.force[a])
            for i in range(n):
                set_rows(model, directions, problem, i)
                for k in range(rows):
                    worst = max(worst, abs(problem.right[rows * i + k]))
            if worst <= NEWTON_ERROR * (1.0 + np.sqrt(scale)):
                return 1
            determinant = factor_dense(problem.matrix, size, problem.order)
            if not worst < np.inf or not abs(determinant) > 0.0:
                return 0
            solve_dense(problem.matrix, size, problem.order, problem.right, problem.step)
            share = 1.0 if trial < FULL_STEPS else 0.5
            for a in range(size):
                problem.force[a] += share * problem.step[a]
        return 0

    return newton
