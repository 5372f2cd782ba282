"""Dense linear algebra for small systems: elimination with pivoting, orthogonalization."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Integers

ORTHOGONAL = 1e-15
MAX_SWEEPS = 30
INDEPENDENT = 1e-3  # least relative length of a row after projection
LESSENED = 0.1  # relative squared length below which a projection is repeated


@compiled
def factor_dense(matrix: Floats, size: int, order: Integers) -> float:
    """Computes LU factors in place, with the row order in ``order``; returns the determinant."""
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
    """Solves the factored system; ``right`` and ``solution`` must be different arrays."""
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
    """Solves the transposed system; overwrites ``right``."""
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
def invert_dense(matrix: Floats, size: int, order: Integers) -> bool:
    """Inverts a matrix in place (Gauss-Jordan); False if it is singular."""
    for k in range(size):
        best = k
        for row in range(k + 1, size):
            if abs(matrix[row, k]) > abs(matrix[best, k]):
                best = row
        if not abs(matrix[best, k]) > 0.0:
            return False
        order[k] = best
        if best != k:
            for column in range(size):
                value = matrix[k, column]
                matrix[k, column] = matrix[best, column]
                matrix[best, column] = value
        inverse = 1.0 / matrix[k, k]
        matrix[k, k] = 1.0
        for column in range(size):
            matrix[k, column] *= inverse
        for row in range(size):
            factor = matrix[row, k]
            if row == k or factor == 0.0:
                continue
            matrix[row, k] = 0.0
            for column in range(size):
                matrix[row, column] -= factor * matrix[k, column]
    for k in range(size - 1, -1, -1):
        if order[k] == k:
            continue
        for row in range(size):
            value = matrix[row, k]
            matrix[row, k] = matrix[row, order[k]]
            matrix[row, order[k]] = value
    return True


@compiled
def make_rows_orthonormal(rows: Floats, count: int, length: int, kept: Floats) -> bool:
    """Orthonormalizes rows (Gram-Schmidt).

    The last column, such as a right-hand side, is also transformed, but excluded from products.
    Returns False, with the rows unchanged, if they are nearly dependent. ``kept`` is a buffer.
    """
    last = rows.shape[1] - 1
    for p in range(count):
        for k in range(length):
            kept[p, k] = rows[p, k]
        kept[p, last] = rows[p, last]
        before = _take_off_rows(rows, p, length)
        after = _squared(rows, p, length)
        if not after > INDEPENDENT * INDEPENDENT * before:
            _put_back(rows, p + 1, length, kept)
            return False
        if after < LESSENED * before:
            # A small remainder has lost accuracy.
            _take_off_rows(rows, p, length)
            after = _squared(rows, p, length)
        inverse = 1.0 / np.sqrt(after)
        for k in range(length):
            rows[p, k] *= inverse
        rows[p, last] *= inverse
    return True


@compiled
def _take_off_rows(rows: Floats, p: int, length: int) -> float:
    """Subtracts projections of row ``p`` on preceding rows; returns its initial squared length."""
    last, before = rows.shape[1] - 1, _squared(rows, p, length)
    for q in range(p):
        part = 0.0
        for k in range(length):
            part += rows[p, k] * rows[q, k]
        for k in range(length):
            rows[p, k] -= part * rows[q, k]
        rows[p, last] -= part * rows[q, last]
    return before


@compiled
def _squared(rows: Floats, p: int, length: int) -> float:
    total = 0.0
    for k in range(length):
        total += rows[p, k] * rows[p, k]
    return total


@compiled
def _put_back(rows: Floats, count: int, length: int, kept: Floats) -> None:
    last = rows.shape[1] - 1
    for p in range(count):
        for k in range(length):
            rows[p, k] = kept[p, k]
        rows[p, last] = kept[p, last]


@compiled
def make_rows_orthogonal(rows: Floats, count: int, length: int) -> None:
    """Rotates rows pairwise until all are orthogonal (one-sided Jacobi).

    The rows of G become those of J G = diag(sigma) V^T, J orthogonal. The last column, such as a
    right-hand side, is also rotated, but excluded from products.
    """
    last = rows.shape[1] - 1
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
                for k in range(length):
                    a, b = rows[p, k], rows[q, k]
                    rows[p, k] = cosine * a - sine * b
                    rows[q, k] = sine * a + cosine * b
                a, b = rows[p, last], rows[q, last]
                rows[p, last] = cosine * a - sine * b
                rows[q, last] = sine * a + cosine * b
        if turned == 0:
            return


@compiled
def diagonalise(matrix: Floats, vectors: Floats, size: int) -> None:
    """Diagonalizes a symmetric matrix by rotations (Jacobi).

    Args:
        matrix: Its diagonal becomes the eigenvalues, unordered.
        vectors: Its columns are also rotated: the identity becomes the eigenvectors.
        size: Size of both.
    """
    for _ in range(MAX_SWEEPS):
        turned = 0
        for p in range(size - 1):
            for q in range(p + 1, size):
                beside = matrix[p, q]
                if not beside * beside > ORTHOGONAL * ORTHOGONAL * abs(matrix[p, p] * matrix[q, q]):
                    continue
                turned = 1
                zeta = (matrix[q, q] - matrix[p, p]) / (2.0 * beside)
                tangent = 1.0 / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                if zeta < 0.0:
                    tangent = -tangent
                cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
                _turn_columns(matrix, p, q, size, cosine, cosine * tangent)
                _turn_rows(matrix, p, q, size, cosine, cosine * tangent)
                _turn_columns(vectors, p, q, size, cosine, cosine * tangent)
        if turned == 0:
            return


@compiled
def _turn_columns(matrix: Floats, p: int, q: int, size: int, cosine: float, sine: float) -> None:
    for k in range(size):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p], matrix[k, q] = cosine * a - sine * b, sine * a + cosine * b


@compiled
def _turn_rows(matrix: Floats, p: int, q: int, size: int, cosine: float, sine: float) -> None:
    for k in range(size):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k], matrix[q, k] = cosine * a - sine * b, sine * a + cosine * b
