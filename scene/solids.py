"""The object as triangles and edges: a prism of its outline, or a ball."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import outline
from slipgrasp.scene.primitives import Role, Triangles
from slipgrasp.scene.rotations import Values


def solid(scenario: Scenario, half_depth: float) -> Triangles:
    """The object as a prism of its outline, or as a ball.

    Args:
        scenario: Hand and object.
        half_depth: Half the height of the prism; the half axis of the ball along z [m].
    """
    corners = outline(scenario.object)
    if scenario.object.shape != "sphere":
        return prism(corners, -half_depth, half_depth)
    return _ball(corners, half_depth)


def edges_of(scenario: Scenario) -> NDArray[np.int64]:
    """Pairs of points of the `solid` for its edges; for round objects, only some rings."""
    count = len(outline(scenario.object))
    if scenario.object.shape == "sphere":
        return _ball_rings(count)
    return prism_edges(count)[: 2 * count] if scenario.object.is_round else prism_edges(count)


_PARALLELS = 13
"""Rings of points of a ball, at equal steps of latitude between its poles; one is the equator."""


def _ball(equator: Values, half_axis: float) -> Triangles:
    """A ball from rings of points, from below, then the lower and the upper pole."""
    latitudes = np.linspace(-0.5, 0.5, _PARALLELS + 2)[1:-1] * math.pi
    heights = half_axis * np.sin(latitudes)
    rings = [
        np.column_stack([math.cos(latitude) * equator, np.full(len(equator), height)])
        for latitude, height in zip(latitudes, heights, strict=True)
    ]
    points = np.vstack([*rings, [[0.0, 0.0, -half_axis], [0.0, 0.0, half_axis]]])
    count = len(equator)
    index = np.arange(count)
    after = (index + 1) % count
    south, north = len(points) - 2, len(points) - 1
    last = (_PARALLELS - 1) * count
    faces = [
        np.column_stack([after, index, np.full(count, south)]),
        np.column_stack([last + index, last + after, np.full(count, north)]),
    ]
    for first in range(0, last, count):
        low, high = first + index, first + count + index
        low_after, high_after = first + after, first + count + after
        faces += [np.column_stack([low, low_after, high_after])]
        faces += [np.column_stack([low, high_after, high])]
    return Triangles(Role.OBJECT, points, np.concatenate(faces))


def _ball_rings(count: int) -> NDArray[np.int64]:
    """The equator and two perpendicular meridians."""
    index = np.arange(count)
    middle = _PARALLELS // 2 * count
    rings = [np.column_stack([middle + index, middle + (index + 1) % count])]
    south = _PARALLELS * count
    for start in range(0, count, count // 4):
        way = [south, *(start + count * np.arange(_PARALLELS)).tolist(), south + 1]
        rings.append(np.column_stack([way[:-1], way[1:]]))
    return np.concatenate(rings)


def prism(corners: Values, low: float, high: float) -> Triangles:
    """A convex outline ``(k, 2)`` extruded along z: bottom corners, then top corners."""
    count = len(corners)
    points = np.concatenate([np.column_stack([corners, np.full(count, z)]) for z in (low, high)])
    index = np.arange(count)
    after = (index + 1) % count
    fan = np.stack([np.zeros(count - 2, int), index[1:-1], index[2:]], axis=1)
    sides = [(index, after, after + count), (index, after + count, index + count)]
    faces = [fan[:, ::-1], fan + count, *(np.stack(side, axis=1) for side in sides)]
    return Triangles(Role.OBJECT, points, np.concatenate(faces))


def prism_edges(count: int) -> NDArray[np.int64]:
    """Edges of a prism over ``count`` corners: bottom, top, and vertical."""
    index = np.arange(count)
    after = (index + 1) % count
    pairs = [(index, after), (index + count, after + count), (index, index + count)]
    return np.concatenate([np.stack(pair, axis=1) for pair in pairs])
