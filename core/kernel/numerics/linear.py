"""Small dense linear algebra without allocation or calls into LAPACK."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats

Triple: TypeAlias = tuple[float, float, float]
Symmetric: TypeAlias = tuple[float, float, float, float, float, float]  # 00, 01, 02, 11, 12, 22


@compiled
def cross(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> tuple[float, float, float]:
    """Vector product of two vectors."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def invert_symmetric(matrix: Symmetric) -> tuple[float, Symmetric]:
    """Determinant and inverse of a symmetric 3 x 3 matrix."""
    m00, m01, m02, m11, m12, m22 = matrix
    c00, c01, c02 = m11 * m22 - m12 * m12, m02 * m12 - m01 * m22, m01 * m12 - m02 * m11
    determinant = m00 * c00 + m01 * c01 + m02 * c02
    scale = 1.0 / determinant
    return determinant, (
        scale * c00,
        scale * c01,
        scale * c02,
        scale * (m00 * m22 - m02 * m02),
        scale * (m01 * m02 - m00 * m12),
        scale * (m00 * m11 - m01 * m01),
    )


@compiled
def multiply_symmetric(matrix: Symmetric, vector: Triple) -> Triple:
    """Product of a symmetric 3 x 3 matrix and a vector."""
    m00, m01, m02, m11, m12, m22 = matrix
    x, y, z = vector
    return (
        m00 * x + m01 * y + m02 * z,
        m01 * x + m11 * y + m12 * z,
        m02 * x + m12 * y + m22 * z,
    )


@compiled
def orthonormalize(basis: Floats, triangle: Floats, rows: int, count: int) -> float:
    """QR of the first ``count`` columns of ``basis`` by Gram-Schmidt.

    A column that loses most of its length is orthogonalized twice ("twice is enough").

    Args:
        basis: Its first ``count`` columns become orthonormal.
        triangle: Output of the upper triangle R.
        rows: Length of the columns.
        count: Number of columns.

    Returns:
        The smallest ratio of a column's length after projection to that before; 0 if columns are
        dependent.
    """
    least = 1.0
    for j in range(count):
        for k in range(j):
            triangle[k, j] = 0.0
        length = _squared_length(basis, rows, j)
        _remove_projections(basis, triangle, rows, j)
        rest = _squared_length(basis, rows, j)
        if rest < 0.5 * length:
            _remove_projections(basis, triangle, rows, j)
            rest = _squared_length(basis, rows, j)
        if rest == 0.0 or not rest < np.inf:
            return 0.0
        triangle[j, j] = np.sqrt(rest)
        least = min(least, np.sqrt(rest / length))
        scale = 1.0 / triangle[j, j]
        for i in range(rows):
            basis[i, j] *= scale
    return least


@compiled
def _squared_length(basis: Floats, rows: int, j: int) -> float:
    total = 0.0
    for i in range(rows):
        total += basis[i, j] * basis[i, j]
    return total


@compiled
def _remove_projections(basis: Floats, triangle: Floats, rows: int, j: int) -> None:
    """Makes column j orthogonal to the preceding columns."""
    for k in range(j):
        projection = 0.0
        for i in range(rows):
            projection += basis[i, k] * basis[i, j]
        triangle[k, j] += projection
        for i in range(rows):
            basis[i, j] -= projection * basis[i, k]
