"""Faces of an object in space, and where fingers stand and touch them (docs/space.md).

Only sums, products, quotients and square roots decide what a run starts from, so that it has the
same bits on every machine; angles are for those who look.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chain import chain_points, chain_start
from slipgrasp.core.scenario.curved_faces import FARTHEST, coordinates_on_sphere, slide
from slipgrasp.core.scenario.geometry import Point, base_corners
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialObject, SpatialScenario

Vector = tuple[float, float, float]
Floats = NDArray[np.float64]

HORIZONTAL = 1e-6
# Radii that a tip may slip around a cylinder, of which a face of finite size needs an end.
_ENDLESS = 1e6
# Out of a round object, where its sides have their middles.
_OUTWARD: dict[str, Vector] = {
    "side-0": (0.0, -1.0, 0.0),
    "side-1": (1.0, 0.0, 0.0),
    "side-2": (0.0, 1.0, 0.0),
    "side-3": (-1.0, 0.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "bottom": (0.0, 0.0, -1.0),
}


class SpatialContact(NamedTuple):
    """Where a fingertip touches the object, and the face on which it slides, in the object's frame.

    Attributes:
        anchor: Contact point at zero slip [m].
        tangent_x: Unit vector of the first slip: the object's z axis along the face, its x axis on
            top and bottom.
        tangent_y: Unit vector of the second slip, normal x tangent_x.
        normal: Unit vector into the object.
        outline: Corners of the face in slips (s_x, s_y), counterclockwise as seen from inside [m].
        curvatures: Of the face along its tangents [1/m].
    """

    anchor: Vector
    tangent_x: Vector
    tangent_y: Vector
    normal: Vector
    outline: tuple[Point, ...]
    curvatures: Point = (0.0, 0.0)


@lru_cache(maxsize=64)
def spatial_contact(body: SpatialObject, finger: SpatialFinger) -> SpatialContact:
    """The frame in which a fingertip slides on its face.

    Args:
        body: The object.
        finger: The finger that touches it, on one of its `face_names`.
    """
    if body.is_round and not has_disc(body, finger):
        return _curved_contact(body, finger)
    middle, corners, normal = _face(body, finger.face)
    tangent_x, tangent_y = _tangents(normal)
    x, y = finger.contact_offset
    anchor = _plus(middle, _plus(_scaled(tangent_x, x), _scaled(tangent_y, y)))
    outline = [
        (_dot(_minus(corner, anchor), tangent_x), _dot(_minus(corner, anchor), tangent_y))
        for corner in corners
    ]
    return SpatialContact(anchor, tangent_x, tangent_y, normal, tuple(_counterclockwise(outline)))


def _tangents(normal: Vector) -> tuple[Vector, Vector]:
    up = (0.0, 0.0, 1.0)
    along = _minus(up, _scaled(normal, _dot(up, normal)))
    length = math.sqrt(_dot(along, along))
    tangent_x = _scaled(along, 1.0 / length) if length > HORIZONTAL else (1.0, 0.0, 0.0)
    return tangent_x, cross(normal, tangent_x)


def has_disc(body: SpatialObject, finger: SpatialFinger) -> bool:
    """Whether a finger touches an end of a cylinder, whose outline is drawn as a polygon."""
    return body.shape == "cylinder" and finger.face in ("top", "bottom")


def _curved_contact(body: SpatialObject, finger: SpatialFinger) -> SpatialContact:
    """On the side of a cylinder or a sphere, where the offset is an arc."""
    normal, curvature = _scaled(_OUTWARD[finger.face], -1.0), 1.0 / body.radius
    (x, y), far = finger.contact_offset, body.radius * _ENDLESS
    curvatures, ends = (0.0, curvature), (body.half_height + x, body.half_height - x, far)
    if body.shape == "sphere":
        curvatures = (curvature, curvature)
        x, y = coordinates_on_sphere(curvature, finger.contact_offset).tolist()
        ends = (body.radius * FARTHEST,) * 3
    anchor, axes = slide(
        _scaled(normal, -body.radius), (*_tangents(normal), normal), curvatures, (x, y)
    )
    low, high, side = ends
    outline = ((-low, -side), (high, -side), (high, side), (-low, side))
    vectors = [(row[0], row[1], row[2]) for row in (anchor.tolist(), *axes.tolist())]
    return SpatialContact(vectors[0], vectors[1], vectors[2], vectors[3], outline, curvatures)


def _face(body: SpatialObject, name: str) -> tuple[Vector, list[Vector], Vector]:
    """Middle, corners and inward normal of a face."""
    corners, half = base_corners(body), 0.5 * body.height
    if name in ("top", "bottom"):
        height = half if name == "top" else -half
        normal = (0.0, 0.0, -1.0 if name == "top" else 1.0)
        return (0.0, 0.0, height), [(x, y, height) for x, y in corners], normal
    first = int(name.removeprefix("side-"))
    (x0, y0), (x1, y1) = corners[first], corners[(first + 1) % len(corners)]
    length = math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    # From a corner to the next the object lies on the left.
    normal = ((y0 - y1) / length, (x1 - x0) / length, 0.0)
    outline = [(x0, y0, -half), (x1, y1, -half), (x1, y1, half), (x0, y0, half)]
    return (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0), outline, normal


def _counterclockwise(outline: list[Point]) -> list[Point]:
    following = [*outline[1:], outline[0]]
    pairs = zip(outline, following, strict=True)
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs)
    return outline if area > 0.0 else outline[::-1]


def distance_inside(outline: tuple[Point, ...], slip: Point) -> float:
    """Least signed distance of a slip to the edges of its face, positive inside [m]."""
    return min(a * slip[0] + b * slip[1] + c for a, b, c in edges_of(outline))


def edges_of(outline: tuple[Point, ...]) -> tuple[tuple[float, float, float], ...]:
    """Every edge as (a, b, c): a s_x + b s_y + c is the distance to it, positive inside."""
    edges = []
    for (x0, y0), (x1, y1) in zip(outline, (*outline[1:], outline[0]), strict=True):
        length = math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
        a, b = (y0 - y1) / length, (x1 - x0) / length
        edges.append((a, b, -a * x0 - b * y0))
    return tuple(edges)


def friction_outline(scenario: Scenario, corners: int = 48) -> Floats:
    """What friction cannot leave, in shares of mu F_n along (t_x, t_y), or (t_y, t_x).

    Args:
        scenario: Of a spatial hand: a circle on the cone, a square in the pyramid; of a planar
            hand the two ends of a line.
        corners: Of the outline; a multiple of 8, so that those of the square are among them.

    Returns:
        The outline, counterclockwise, shape ``(corners, 2)``; of a line ``(2, 1)``.
    """
    if scenario.friction_cone == "line":
        return np.array([[1.0], [-1.0]])
    angles = np.linspace(0.0, 2.0 * math.pi, corners, endpoint=False)
    outline = np.column_stack([np.cos(angles), np.sin(angles)])
    if scenario.friction_cone == "pyramid":
        outline /= np.abs(outline).max(axis=1, keepdims=True)
    return outline


def rotation_matrix(quaternion: tuple[float, float, float, float]) -> tuple[Vector, Vector, Vector]:
    """Rows of R(Q), world from object, of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = quaternion
    scale = 1.0 / (w * w + x * x + y * y + z * z)
    return (
        (
            1.0 - 2.0 * scale * (y * y + z * z),
            2.0 * scale * (x * y - w * z),
            2.0 * scale * (x * z + w * y),
        ),
        (
            2.0 * scale * (x * y + w * z),
            1.0 - 2.0 * scale * (x * x + z * z),
            2.0 * scale * (y * z - w * x),
        ),
        (
            2.0 * scale * (x * z - w * y),
            2.0 * scale * (y * z + w * x),
            1.0 - 2.0 * scale * (x * x + y * y),
        ),
    )


def tip_at_start(scenario: SpatialScenario, index: int) -> Vector:
    """Where a fingertip is in the start pose, from the base of its finger [m]."""
    finger, start = scenario.fingers[index], scenario.trajectory.start
    anchor = spatial_contact(scenario.object, finger).anchor
    rows = rotation_matrix((start[3], start[4], start[5], start[6]))
    x, y, z = (_dot(row, anchor) for row in rows)
    base = finger.base
    return (x + start[0] - base[0], y + start[1] - base[1], z + start[2] - base[2])


def first_seeds(scenario: SpatialScenario) -> list[tuple[float, ...]]:
    """Joint positions from which those of chains at the start are looked for; 0 of others."""
    seeds = []
    for i, finger in enumerate(scenario.fingers):
        start = None
        if finger.kind == "chain":
            chain = finger.attitude, finger.joints, finger.tip
            start = chain_start(*chain, tip_at_start(scenario, i), finger.posture)
        seeds.append(finger.posture if start is None else start[0])
    return seeds


def spatial_joint_points(finger: SpatialFinger, joint_positions: Floats) -> Floats:
    """Where base, elbow and tip of a finger stand, shape ``(..., 3, 3)``: point, axis [m].

    Of a chain the starts of its three links, and the tip, ``(..., 4, 3)``.

    Args:
        finger: Base and link lengths.
        joint_positions: Yaw and the two pitches, the second relative to the first link, shape
            ``(..., 3)`` [rad]; positions of slides [m].
    """
    if finger.kind == "slides":
        return _slide_points(finger.base, joint_positions)
    if finger.kind == "chain":
        points, _ = chain_points(finger.attitude, finger.joints, finger.tip, joint_positions)
        return np.asarray(finger.base) + points
    angles = np.asarray(joint_positions)
    yaw, pitches = angles[..., :1], np.cumsum(angles[..., 1:], axis=-1)
    across, up = np.cos(pitches), np.sin(pitches)
    directions = np.stack([across * np.cos(yaw), across * np.sin(yaw), up], axis=-1)
    links = np.asarray(finger.link_lengths)[:, None] * directions
    base = np.broadcast_to(np.asarray(finger.base), (*angles.shape[:-1], 1, 3))
    return np.concatenate([base, base + np.cumsum(links, axis=-2)], axis=-2)


def _slide_points(base: Vector, positions: Floats) -> Floats:
    """Zero of slides, carriage on the first, and tip, shape ``(..., 3, 3)`` [m]."""
    tip = np.asarray(positions)
    carriage = tip * np.array([1.0, 0.0, 0.0])
    return np.asarray(base) + np.stack([np.zeros_like(tip), carriage, tip], axis=-2)


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _plus(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _scaled(a: Vector, factor: float) -> Vector:
    return (factor * a[0], factor * a[1], factor * a[2])
