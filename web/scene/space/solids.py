"""Bodies that the picture of a hand in space is made of, and how they are turned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.web.scene.shapes import Mesh, circle

Points = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]

_SEGMENTS = 28


def prism(corners: Points, height: float) -> Mesh:
    """A convex base ``(k, 2)`` drawn out along z, half of it below z = 0."""
    count, half = len(corners), 0.5 * height
    vertices = np.concatenate(
        [np.column_stack([corners, np.full(count, z)]) for z in (-half, half)]
    )
    index = np.arange(count)
    after = (index + 1) % count
    fan = np.stack([np.zeros(count - 2, int), index[1:-1], index[2:]], axis=1)
    sides = [(index, after, after + count), (index, after + count, index + count)]
    faces = np.concatenate([fan[:, ::-1], fan + count, *(np.stack(s, axis=1) for s in sides)])
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


def prism_edges(corners: Points, height: float) -> Points:
    """The edges of a prism, shape ``(edges, 2, 3)``."""
    low, high = (
        np.column_stack([corners, np.full(len(corners), z)]) for z in (-0.5 * height, 0.5 * height)
    )
    rims = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in (low, high)]
    return np.concatenate([*rims, np.stack([low, high], axis=1)])


def dashed_edges(edges: Points, dashes: int) -> Points:
    """Every edge ``(edges, 2, 3)`` as some dashes, shape ``(edges dashes, 2, 3)``."""
    steps = np.linspace(0.0, 1.0, 2 * dashes).reshape(1, dashes, 2, 1)
    start, end = edges[:, None, None, 0], edges[:, None, None, 1]
    return (start + steps * (end - start)).reshape(-1, 2, 3)


def turned_profile(profile: Points) -> Mesh:
    """A profile of points (x, radius), turned about the x axis; closed where its radius is 0."""
    ring = circle(1.0, _SEGMENTS)
    vertices = np.concatenate(
        [np.column_stack([np.full(_SEGMENTS, x), radius * ring]) for x, radius in profile]
    )
    index = np.arange(_SEGMENTS)
    after = (index + 1) % _SEGMENTS
    faces = []
    for k in range(len(profile) - 1):
        a, b = k * _SEGMENTS, (k + 1) * _SEGMENTS
        faces += [
            np.stack([a + index, a + after, b + after], axis=1),
            np.stack([a + index, b + after, b + index], axis=1),
        ]
    return Mesh(vertices.astype(np.float32), np.concatenate(faces).astype(np.uint32))


def rounded_bar(length: float, start_radius: float, end_radius: float) -> Mesh:
    """A round bar along x with round ends, wider at its start than at its end."""
    quarter = np.linspace(0.0, 0.5 * np.pi, 7)
    back = np.stack([-start_radius * np.cos(quarter), start_radius * np.sin(quarter)], axis=1)
    front = np.stack([end_radius * np.sin(quarter), end_radius * np.cos(quarter)], axis=1)
    return turned_profile(np.concatenate([back, front + np.array([length, 0.0])]))


def open_cone(friction: float, length: float, outline: Points) -> Mesh:
    """A friction cone or pyramid of a slant height [m] about x, its tip in the origin.

    Args:
        friction: The friction coefficient.
        length: The slant height [m].
        outline: Across x, for a friction coefficient of 1 and a height of 1, ``(k, 2)``.
    """
    height, index = length / np.hypot(1.0, friction), np.arange(len(outline)) + 1
    rim = np.column_stack([np.full(len(outline), height), height * friction * outline])
    faces = np.stack([np.zeros_like(index), index, np.roll(index, -1)], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), rim])
    return Mesh(vertices.astype(np.float32), faces.astype(np.uint32))


def quaternion_of(columns: Points) -> Quaternion:
    """The unit quaternion (w, x, y, z) of a rotation given by its columns, ``(3, 3)``."""
    # The eigenvector of the largest eigenvalue: no case distinction by signs (Bar-Itzhack).
    m = columns
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


def about_z(angle: float) -> Quaternion:
    """The quaternion (w, x, y, z) of a turn about the vertical [rad]."""
    return (float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle)))


def rotation_of(quaternion: Points) -> Points:
    """The rotation ``(3, 3)`` of a unit quaternion (w, x, y, z)."""
    w, v = quaternion[0], quaternion[1:]
    S = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + 2.0 * (w * S + S @ S)


def triple(point: Points) -> tuple[float, float, float]:
    """A point as viser takes positions."""
    return (float(point[0]), float(point[1]), float(point[2]))
