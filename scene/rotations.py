"""Rotations as unit quaternions (w, x, y, z), in arrays of shape ``(..., 4)``."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

UNTURNED = (1.0, 0.0, 0.0, 0.0)
_LEAST_COSINE = 1e-12


def about(axis: Values, angles: Values) -> Values:
    """Rotations about a unit axis by angles ``(...)`` [rad]."""
    half = 0.5 * np.asanyarray(angles)
    turned = np.empty_like(half, shape=(*half.shape, 4))
    turned[..., 0] = np.cos(half)
    turned[..., 1:] = np.sin(half)[..., None] * axis
    return turned


def from_vectors(vectors: Values) -> Values:
    """Rotations of rotation vectors ``(..., 3)`` [rad]."""
    half = 0.5 * np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / math.pi) * vectors], axis=-1)


def product(first: Values, second: Values) -> Values:
    """The rotation ``second`` followed by ``first``."""
    a, b = np.broadcast_arrays(first, second, subok=True)
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def matrices(quaternions: Values) -> Values:
    """Rotation matrices ``(..., 3, 3)`` of quaternions of any nonzero length."""
    unit = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    w, x, y, z = (unit[..., k] for k in range(4))
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    # Filled in place: stacking nine small arrays takes longer than computing them.
    found = np.empty_like(unit, shape=(*unit.shape[:-1], 3, 3))
    for i, row in enumerate(rows):
        for k, entries in enumerate(row):
            found[..., i, k] = entries
    return found


def about_z(quaternions: Values) -> Values:
    """Angles of rotations about z alone, ``(...)`` [rad]."""
    return 2.0 * np.arctan2(quaternions[..., 3], quaternions[..., 0])


def of_matrix(matrix: Values) -> tuple[float, float, float, float]:
    """The rotation of a matrix ``(3, 3)``."""
    m = matrix
    # The eigenvector of the largest eigenvalue, without distinction of cases (Bar-Itzhack).
    K = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    w, x, y, z = np.linalg.eigh(K)[1][:, -1].tolist()
    return (w, x, y, z)


def from_x_to(vectors: Values) -> Values:
    """The shortest rotations of the x axis to directions ``(n, 3)``; none for zero."""
    # Scaled first, so that the largest numbers in a recording do not overflow.
    unit = vectors / np.maximum(np.abs(vectors).max(axis=1, keepdims=True), 1e-300)
    unit = unit / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-300)
    turned = np.stack([1.0 + unit[:, 0], 0.0 * unit[:, 0], -unit[:, 2], unit[:, 1]], axis=1)
    turned[turned[:, 0] < _LEAST_COSINE] = (0.0, 0.0, 0.0, 1.0)  # opposite: half a turn about z
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def from_z_to(vector: Sequence[float]) -> tuple[float, float, float, float]:
    """The shortest rotation of the z axis to one direction, as numbers."""
    x, y, z = vector
    length = math.hypot(x, y, z)
    cosine = 1.0 + z / length
    if cosine < _LEAST_COSINE:
        return (0.0, 1.0, 0.0, 0.0)  # opposite: half a turn about x
    size = math.hypot(cosine, x / length, y / length)
    return (cosine / size, -y / length / size, x / length / size, 0.0)
