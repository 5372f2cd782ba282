"""Meshes and line segments that the scene is made of.

The model's plane stands upright in the viewer: x to the right, y up, and depth towards the
eye, so that what is drawn in front hides nothing by accident.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


class Mesh(NamedTuple):
    """Triangles: vertices ``(v, 3)`` in viewer coordinates and faces ``(f, 3)``."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]


def lift(points: Points, depth: float = 0.0) -> NDArray[np.float32]:
    """Model points (..., 2) as viewer points (..., 3), ``depth`` nearer to the eye [m]."""
    flat = np.full(points.shape[:-1], -depth)
    return np.stack([points[..., 0], flat, points[..., 1]], axis=-1).astype(np.float32)


AXES = (0, 2)
"""Which of viser's axes are the model's x and y: its y points up, and viser's third one does."""


def position(point: Points, depth: float = 0.0) -> tuple[float, float, float]:
    """One model point (x, y) as the position of a node, ``depth`` nearer to the eye [m]."""
    return (float(point[0]), -depth, float(point[1]))


def turn(angle: float) -> tuple[float, float, float, float]:
    """The quaternion (w, x, y, z) that turns the model's plane by an angle [rad]."""
    return (math.cos(0.5 * angle), 0.0, -math.sin(0.5 * angle), 0.0)


def circle(radius: float, segments: int = 48) -> Points:
    """Corners of a round outline, anticlockwise, shape ``(segments, 2)``."""
    angles = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def arc(radius: float, start: float, end: float, segments: int = 24) -> Points:
    """Points of an arc from one angle to another [rad], shape ``(segments + 1, 2)``."""
    angles = np.linspace(start, end, segments + 1)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def tapered_bar(length: float, start_radius: float, end_radius: float) -> Points:
    """Outline of a bar along x with round ends, wider at its start than at its end."""
    lean = math.asin(min(max((start_radius - end_radius) / length, -0.9), 0.9))
    upper = 0.5 * math.pi - lean
    back = arc(start_radius, upper, 2.0 * math.pi - upper)
    front = arc(end_radius, -upper, upper) + np.array([length, 0.0])
    return np.concatenate([back, front])


def extrude(outline: Points, back: float, front: float) -> Mesh:
    """A convex outline ``(k, 2)`` as a slab between two depths towards the eye [m]."""
    count = len(outline)
    vertices = np.concatenate([lift(outline, back), lift(outline, front)])
    index = np.arange(count)
    following = (index + 1) % count
    fan = np.stack([np.zeros(count - 2, int), index[1:-1], index[2:]], axis=1)
    sides = np.concatenate(
        [
            np.stack([index, following, following + count], axis=1),
            np.stack([index, following + count, index + count], axis=1),
        ]
    )
    faces = np.concatenate([fan + count, fan[:, ::-1], sides])
    return Mesh(vertices, faces.astype(np.uint32))


def polyline(points: Points, depth: float, *, closed: bool = False) -> NDArray[np.float32]:
    """The segments ``(k, 2, 3)`` that join model points ``(k, 2)`` in order."""
    ends = np.roll(points, -1, axis=0)
    segments = lift(np.stack([points, ends], axis=1), depth)
    return segments if closed else segments[:-1]


def distance_to_circle(start: Points, direction: Points, radius: float) -> float:
    """How far a ray goes until it leaves a circle about the origin; 0 if it starts outside.

    Args:
        start: Where it starts, shape ``(2,)``.
        direction: Unit vector.
        radius: Radius of the circle, in the unit of ``start``.
    """
    along = float(start @ direction)
    inside = radius**2 - float(start @ start)
    return -along + math.sqrt(along**2 + inside) if inside > 0.0 else 0.0
