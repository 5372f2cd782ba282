"""Dense linear algebra of small systems: elimination with row exchanges, orthogonal rows."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compiler import compiled
from slipgrasp.core.kernel.records import Floats, Integers

ORTHOGONAL = 1e-15
MAX_SWEEPS = 30


@compiled
def factor_dense(matrix: Floats, size: int, order: Integers) -> float:
    """LU factors of a matrix in its place, rows in ``order``; returns its determinant."""
    determinant = 1.0
    for k in range(size):
        order[k] = k
    for k in range(size):
        best = k
        for row in range(k + 1, size):
            if abs(matrix[row, k]) > abs(matrix[best, k]):
                best = row
        if best != k:
            determinant = -determinant
            kept = order[k]
            order[k] = order[best]
            order[best] = kept
            for column in range(size):
                value = matrix[k, column]
                matrix[k, column] = matrix[best, column]
                matrix[best, column] = value
        pivot = matrix[k, k]
        determinant *= pivot
        inverse = 1.0 / pivot
        for row in range(k + 1, size):
            factor = matrix[row, k] * inverse
            matrix[row, k] = factor
            for column in range(k + 1, size):
                matrix[row, column] -= factor * matrix[k, column]
    return determinant


@compiled
def solve_dense(
    factors: Floats, size: int, order: Integers, right: Floats, solution: Floats
) -> None:
    """Solution of the factored system; ``right`` and ``solution`` are two arrays."""
    for k in range(size):
        total = right[order[k]]
        for column in range(k):
            total -= factors[k, column] * solution[column]
        solution[k] = total
    for k in range(size - 1, -1, -1):
        total = solution[k]
        for column in range(k + 1, size):
            total -= factors[k, column] * solution[column]
        solution[k] = total / factors[k, k]


@compiled
def solve_dense_transposed(
    factors: Floats, size: int, order: Integers, right: Floats, solution: Floats
) -> None:
    """Solution of the transposed system; ``right`` is overwritten."""
    for k in range(size):
        total = right[k]
        for row in range(k):
            total -= factors[row, k] * right[row]
        right[k] = total / factors[k, k]
    for k in range(size - 1, -1, -1):
        total = right[k]
        for row in range(k + 1, size):
            total -= factors[row, k] * right[row]
        right[k] = total
    for k in range(size):
        solution[order[k]] = right[k]


@compiled
def make_rows_orthogonal(rows: Floats, count: int, length: int) -> None:
    """Turns rows pairwise until all are orthogonal (one-sided Jacobi).

    The rows of G become those of J G = diag(sigma) V^T, J orthogonal: what stands beyond
    ``length`` in a row, such as a right side, is turned with it, but does not count.
    """
    whole = rows.shape[1]
    for _ in range(MAX_SWEEPS):
        turned = 0
        for p in range(count - 1):
            for q in range(p + 1, count):
                alpha = beta = gamma = 0.0
                for k in range(length):
                    alpha += rows[p, k] * rows[p, k]
                    beta += rows[q, k] * rows[q, k]
                    gamma += rows[p, k] * rows[q, k]
                if not gamma * gamma > ORTHOGONAL * ORTHOGONAL * alpha * beta:
                    continue
                turned = 1
                zeta = (beta - alpha) / (2.0 * gamma)
                tangent = 1.0 / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                if zeta < 0.0:
                    tangent = -tangent
                cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
                sine = cosine * tangent
                for k in range(whole):
                    a, b = rows[p, k], rows[q, k]
                    rows[p, k] = cosine * a - sine * b
                    rows[q, k] = sine * a + cosine * b
        if turned == 0:
            return
