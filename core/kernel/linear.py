"""Small dense linear algebra without allocation or calls into LAPACK."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.records import Floats, Integers


@compiled
def factor(matrix: Floats, pivots: Integers, size: int) -> float:
    """LU factors of the leading square of a matrix in place, rows exchanged by size.

    Returns:
        The determinant; 0 where a pivot vanishes (the factors are then not usable).
    """
    determinant = 1.0
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if best != k:
            determinant = -determinant
            for j in range(size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        pivot = matrix[k, k]
        determinant *= pivot
        if pivot == 0.0:
            return 0.0
        for i in range(k + 1, size):
            ratio = matrix[i, k] / pivot
            matrix[i, k] = ratio
            if ratio != 0.0:
                for j in range(k + 1, size):
                    matrix[i, j] -= ratio * matrix[k, j]
    return determinant


@compiled
def solve(factors: Floats, pivots: Integers, size: int, vector: Floats) -> None:
    """Overwrites ``vector`` with the solution of A x = vector."""
    for k in range(size):
        best = pivots[k]
        if best != k:
            vector[k], vector[best] = vector[best], vector[k]
    for i in range(size):
        for j in range(i):
            vector[i] -= factors[i, j] * vector[j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            vector[i] -= factors[i, j] * vector[j]
        vector[i] /= factors[i, i]


@compiled
def solve_transposed(factors: Floats, pivots: Integers, size: int, vector: Floats) -> None:
    """Overwrites ``vector`` with the solution of A^T x = vector."""
    for i in range(size):
        for j in range(i):
            vector[i] -= factors[j, i] * vector[j]
        vector[i] /= factors[i, i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            vector[i] -= factors[j, i] * vector[j]
    for k in range(size - 1, -1, -1):
        best = pivots[k]
        if best != k:
            vector[k], vector[best] = vector[best], vector[k]


@compiled
def condition(
    matrix: Floats, factors: Floats, pivots: Integers, size: int, column: Floats
) -> float:
    """Condition number in the 1-norm of a matrix whose factors are known."""
    norm = 0.0
    inverse_norm = 0.0
    for j in range(size):
        total = 0.0
        for i in range(size):
            total += abs(matrix[i, j])
            column[i] = 0.0
        norm = max(norm, total)
        column[j] = 1.0
        solve(factors, pivots, size, column)
        total = 0.0
        for i in range(size):
            total += abs(column[i])
        inverse_norm = max(inverse_norm, total)
    return norm * inverse_norm


@compiled
def orthonormalize(basis: Floats, triangle: Floats, rows: int, count: int) -> float:
    """QR of the first ``count`` columns of ``basis`` by Gram-Schmidt, each column twice.

    Args:
        basis: Its first ``count`` columns become orthonormal.
        triangle: Upper triangle R is written here.
        rows: Length of the columns.
        count: Number of columns.

    Returns:
        The least ratio of a column's rest to its length: 0 where columns depend on each other.
    """
    least = 1.0
    for j in range(count):
        length = 0.0
        for i in range(rows):
            length += basis[i, j] ** 2
        for k in range(j):
            triangle[k, j] = 0.0
        for _ in range(2):
            for k in range(j):
                projection = 0.0
                for i in range(rows):
                    projection += basis[i, k] * basis[i, j]
                triangle[k, j] += projection
                for i in range(rows):
                    basis[i, j] -= projection * basis[i, k]
        rest = 0.0
        for i in range(rows):
            rest += basis[i, j] ** 2
        rest = np.sqrt(rest)
        triangle[j, j] = rest
        if rest == 0.0 or not rest < np.inf:
            return 0.0
        least = min(least, rest / np.sqrt(length))
        for i in range(rows):
            basis[i, j] /= rest
    return least


@compiled
def complement(basis: Floats, rows: int, count: int, direction: Floats) -> None:
    """A unit vector orthogonal to the first ``count`` orthonormal columns of ``basis``."""
    best = 0
    largest = -1.0
    for i in range(rows):
        rest = 1.0
        for k in range(count):
            rest -= basis[i, k] ** 2
        if rest > largest + 1e-9:
            largest = rest
            best = i
    for i in range(rows):
        direction[i] = 0.0
    direction[best] = 1.0
    for _ in range(2):
        for k in range(count):
            projection = 0.0
            for i in range(rows):
                projection += basis[i, k] * direction[i]
            for i in range(rows):
                direction[i] -= projection * basis[i, k]
        length = 0.0
        for i in range(rows):
            length += direction[i] ** 2
        length = np.sqrt(length)
        for i in range(rows):
            direction[i] /= length
