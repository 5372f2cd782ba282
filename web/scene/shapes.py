"""Meshes and line segments for the viewer, as arrays.

Flat elements on a face are drawn in an upright plane of the viewer: x to the right, y of the plane
along its z, and depth towards the viewer.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.hand_files.meshes import Mesh
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.solids import prism

_SEGMENTS = 28


def lift(points: Values, depth: float = 0.0) -> NDArray[np.float32]:
    """Points of a plane (..., 2) as viewer points (..., 3), ``depth`` nearer to the viewer [m]."""
    flat = np.full(points.shape[:-1], -depth)
    return np.stack([points[..., 0], flat, points[..., 1]], axis=-1).astype(np.float32)


def circle(radius: float, segments: int = 48) -> Values:
    """Corners of a round outline, counterclockwise, shape ``(segments, 2)``."""
    return arc(radius, 0.0, 2.0 * math.pi, segments)[:-1]


def arc(radius: float, start: float, end: float, segments: int = 24) -> Values:
    """Points of an arc from one angle to another [rad], shape ``(segments + 1, 2)``."""
    angles = np.linspace(start, end, segments + 1)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def extrude(outline: Values, back: float, front: float) -> Mesh:
    """A convex outline ``(k, 2)`` as a slab between two depths [m]."""
    solid = prism(outline, back, front)
    x, y, depth = solid.points.T
    vertices = np.stack([x, -depth, y], axis=1).astype(np.float32)
    return Mesh(vertices, solid.indices.astype(np.uint32))


def faceted(vertices: NDArray[np.floating], faces: NDArray[np.unsignedinteger]) -> Mesh:
    """The same triangles without common corners, which the viewer then shades as flat faces.

    The viewer's own flat shading would be another program to compile before the first picture.
    """
    corners = vertices[faces].reshape(-1, 3).astype(np.float32)
    return Mesh(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))


def two_sided(mesh: Mesh) -> Mesh:
    """The same triangles once more, seen from behind, with corners of their own."""
    vertices, faces = mesh
    behind = faces[:, ::-1] + np.uint32(len(vertices))
    return Mesh(np.concatenate([vertices, vertices]), np.concatenate([faces, behind]))


def polyline(points: Values, depth: float, *, closed: bool = False) -> NDArray[np.float32]:
    """The segments ``(k, 2, 3)`` that join points of a plane ``(k, 2)`` in order."""
    return joined(lift(points, depth), closed=closed)


def joined(points: NDArray[np.floating], *, closed: bool = False) -> NDArray[np.float32]:
    """The segments ``(k, 2, 3)`` that join points ``(k, 3)`` in order."""
    segments = np.stack([points, np.roll(points, -1, axis=0)], axis=1).astype(np.float32)
    return segments if closed else segments[:-1]


def dashed_edges(edges: Values, dashes: int) -> Values:
    """Every edge ``(edges, 2, 3)`` as some dashes, shape ``(edges dashes, 2, 3)``."""
    steps = np.linspace(0.0, 1.0, 2 * dashes).reshape(1, dashes, 2, 1)
    start, end = edges[:, None, None, 0], edges[:, None, None, 1]
    return (start + steps * (end - start)).reshape(-1, 2, 3)


def turned_profile(profile: Values) -> Mesh:
    """A profile of points (x, radius), rotated about the x axis; closed where its radius is 0."""
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


def fan(corners: int, *, closed: bool) -> NDArray[np.uint32]:
    """Triangles between a first point and the ``corners`` that follow it."""
    index = np.arange(corners if closed else corners - 1) + 1
    after = index % corners + 1
    return np.stack([np.zeros_like(index), index, after], axis=1).astype(np.uint32)
