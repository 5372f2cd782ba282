"""Factors of the reduced inertia M~ of a planar hand, its solutions and its condition number."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, Floats, Integers, Record
from slipgrasp.core.kernel.numerics.linear import Symmetric, invert_symmetric
from slipgrasp.core.kernel.planar.state import count_coordinates, slip_coordinate

# Factors of the reduced inertia M~ in its moving coordinates: those of the object and of the
# slipping contacts. Sticking contacts have s'' = 0, so that their rows and columns are dropped. If
# all stick, M~ is symmetric of order 3 and its inverse is stored; otherwise its LU factors.
FACTORS = np.dtype(
    [
        ("order", np.int64),
        ("coordinates", np.int64, (MAX_COORDINATES,)),  # moving coordinate of each row
        ("inverse", np.float64, (6,)),  # of order 3: 00, 01, 02, 11, 12, 22
        ("lu", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),
        ("pivots", np.int64, (MAX_COORDINATES,)),
        ("determinant", np.float64),  # of M~; 0 if a pivot vanishes
        ("part", np.float64, (MAX_COORDINATES,)),
    ],
    align=True,
)


@compiled
def factor(matrix: Floats, phases: Integers, n: int, factors: Record) -> None:
    """Factors M~ ``(3 + n, 3 + n)`` in its moving coordinates.

    If it is singular, ``determinant`` is 0 and the factors are invalid.
    """
    size = 3
    for i in range(n):
        if phases[i] != 0:
            factors.coordinates[size] = slip_coordinate(i)
            size += 1
    factors.order = size
    if size == 3:
        _invert(matrix, factors)
    else:
        _factor_general(matrix, factors)


@compiled
def _invert(matrix: Floats, factors: Record) -> None:
    """Inverts the symmetric leading 3 x 3 block."""
    factors.determinant, inverse = invert_symmetric(_leading_block(matrix))
    for k in range(6):
        factors.inverse[k] = inverse[k]


@compiled
def _leading_block(matrix: Floats) -> Symmetric:
    """Block of the object, symmetric in every phase."""
    return matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[1, 1], matrix[1, 2], matrix[2, 2]


@compiled
def _apply_inverse(factors: Record, n: int, vector: Floats) -> None:
    inverse = factors.inverse
    x, y, z = vector[0], vector[1], vector[2]
    vector[0] = inverse[0] * x + inverse[1] * y + inverse[2] * z
    vector[1] = inverse[1] * x + inverse[3] * y + inverse[4] * z
    vector[2] = inverse[2] * x + inverse[4] * y + inverse[5] * z
    for i in range(n):
        vector[slip_coordinate(i)] = 0.0


@compiled
def _factor_general(matrix: Floats, factors: Record) -> None:
    """Computes LU factors with partial pivoting."""
    size, lu = factors.order, factors.lu
    for k in range(3):
        factors.coordinates[k] = k
    for row in range(size):
        for column in range(size):
            lu[row, column] = matrix[factors.coordinates[row], factors.coordinates[column]]
    determinant = 1.0
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(lu[i, k]) > abs(lu[best, k]):
                best = i
        factors.pivots[k] = best
        if best != k:
            determinant = -determinant
            for j in range(size):
                lu[k, j], lu[best, j] = lu[best, j], lu[k, j]
        pivot = lu[k, k]
        determinant *= pivot
        if pivot == 0.0:
            break
        inverse = 1.0 / pivot
        for i in range(k + 1, size):
            ratio = lu[i, k] * inverse
            lu[i, k] = ratio
            for j in range(k + 1, size):
                lu[i, j] -= ratio * lu[k, j]
    factors.determinant = determinant


@compiled
def solve(factors: Record, n: int, vector: Floats) -> None:
    """Overwrites ``vector`` ``(3 + n,)`` with the solution of M~ x = vector, 0 in stick."""
    if factors.order == 3:
        _apply_inverse(factors, n, vector)
        return
    size, lu, part = factors.order, factors.lu, factors.part
    for k in range(size):
        part[k] = vector[factors.coordinates[k]]
    for k in range(size):
        best = factors.pivots[k]
        if best != k:
            part[k], part[best] = part[best], part[k]
    for i in range(size):
        for j in range(i):
            part[i] -= lu[i, j] * part[j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            part[i] -= lu[i, j] * part[j]
        part[i] /= lu[i, i]
    _scatter_moving(factors, n, vector)


@compiled
def solve_transposed(factors: Record, n: int, vector: Floats) -> None:
    """Overwrites ``vector`` ``(3 + n,)`` with M~^-T vector; 0 in stick, where it is unused."""
    if factors.order == 3:
        _apply_inverse(factors, n, vector)
        return
    size, lu, part = factors.order, factors.lu, factors.part
    for k in range(size):
        part[k] = vector[factors.coordinates[k]]
    for i in range(size):
        for j in range(i):
            part[i] -= lu[j, i] * part[j]
        part[i] /= lu[i, i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            part[i] -= lu[j, i] * part[j]
    for k in range(size - 1, -1, -1):
        best = factors.pivots[k]
        if best != k:
            part[k], part[best] = part[best], part[k]
    _scatter_moving(factors, n, vector)


@compiled
def _scatter_moving(factors: Record, n: int, vector: Floats) -> None:
    for k in range(count_coordinates(n)):
        vector[k] = 0.0
    for k in range(factors.order):
        vector[factors.coordinates[k]] = factors.part[k]


@compiled
def condition(matrix: Floats, factors: Record, n: int, column: Floats) -> float:
    """Condition number in the 1-norm of M~ in its moving coordinates."""
    if factors.order == 3:
        return _largest_column_sum(_leading_block(matrix)) * _largest_column_sum(factors.inverse)
    norm, inverse_norm = 0.0, 0.0
    for k in range(3):
        factors.coordinates[k] = k
    for j in range(factors.order):
        total = 0.0
        for i in range(factors.order):
            total += abs(float(matrix[factors.coordinates[i], factors.coordinates[j]]))
        norm = max(norm, total)
        inverse_norm = max(inverse_norm, _inverse_column_sum(factors, n, j, column))
    return norm * inverse_norm


@compiled
def _largest_column_sum(symmetric: Symmetric | Floats) -> float:
    """1-norm of a symmetric 3 x 3 matrix."""
    m01, m02, m12 = abs(symmetric[1]), abs(symmetric[2]), abs(symmetric[4])
    first, second = abs(symmetric[0]) + m01 + m02, m01 + abs(symmetric[3]) + m12
    # The leading 0.0 makes max ignore NaN sums of a singular matrix.
    return max(0.0, first, second, m02 + m12 + abs(symmetric[5]))


@compiled
def _inverse_column_sum(factors: Record, n: int, j: int, column: Floats) -> float:
    total = 0.0
    for k in range(count_coordinates(n)):
        column[k] = 0.0
    column[factors.coordinates[j]] = 1.0
    solve(factors, n, column)
    for k in range(count_coordinates(n)):
        total += abs(float(column[k]))
    return total
