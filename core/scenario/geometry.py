"""Positions of fingers and contacts (docs/model.md, Contact)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import FingerParameters, ObjectParameters, PlanarScenario
from slipgrasp.core.scenario.curved_faces import slide
from slipgrasp.core.scenario.scenario import AnyObject

Point = tuple[float, float]


class ContactFrame(NamedTuple):
    """Anchor, tangent and inward normal of a contact in the object frame, and its slip range.

    Attributes:
        anchor: Contact point at zero slip (x, y) [m].
        tangent: Unit vector of positive slip; the normal is the tangent rotated by -90 degrees.
        normal: Unit vector into the object.
        slip_minimum: Slip at which the fingertip passes one end of the face [m]; none on a circle.
        slip_maximum: Slip at which it passes the other end [m].
        curvature: Curvature of the face, 0 if it is straight [1/m].
    """

    anchor: tuple[float, float]
    tangent: tuple[float, float]
    normal: tuple[float, float]
    slip_minimum: float
    slip_maximum: float
    curvature: float = 0.0


# Faces of a rectangle in the order of `Face`.
TANGENTS = {
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
    "bottom": (-1.0, 0.0),
    "top": (1.0, 0.0),
}


ROUND_CORNERS = 48
"""Number of corners of the polygon that represents a round outline."""


def base_corners(body: AnyObject) -> tuple[Point, ...]:
    """Corners (x, y) of a planar object, or of the base of a prism, counterclockwise [m].

    For a round object, the corners of an inscribed polygon.
    """
    x, y = body.half_sizes
    if body.is_round:
        angles = np.linspace(0.0, 2.0 * math.pi, ROUND_CORNERS, endpoint=False).tolist()
        return tuple((x * math.cos(angle), y * math.sin(angle)) for angle in angles)
    return body.corners or ((-x, -y), (x, -y), (x, y), (-x, y))


def outline(body: AnyObject) -> NDArray[np.float64]:
    """The corners as an array, shape ``(corners, 2)`` [m]."""
    return np.array(base_corners(body))


def inner_radius(body: AnyObject) -> float:
    """Distance from the centre of mass to the nearest face of the object [m]."""
    if body.is_round:
        return min(body.half_height, *body.half_sizes)
    corners = outline(body)
    sides = np.roll(corners, -1, axis=0) - corners
    areas = corners[:, 0] * sides[:, 1] - corners[:, 1] * sides[:, 0]
    return min(body.half_height, float((areas / np.hypot(*sides.T)).min()))


def smallest_extent(body: ObjectParameters) -> float:
    """Smallest distance of two parallel lines that enclose the object [m]."""
    if body.is_round:
        return 2.0 * body.radius
    corners = outline(body)
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([-sides[:, 1], sides[:, 0]], axis=1) / np.hypot(*sides.T)[:, None]
    # For a convex polygon, one of these lines contains a side.
    return float(np.ptp(normals @ corners.T, axis=1).min())


def contact_frame(body: ObjectParameters, finger: FingerParameters) -> ContactFrame:
    """The frame in which a fingertip slides on its face.

    Args:
        body: The object.
        finger: The finger that touches the object, on one of its `face_names`.
    """
    offset = finger.contact_offset
    if body.is_round:
        return _round_frame(body.radius, TANGENTS[finger.face], offset)
    if body.corners:
        return _edge_frame(body, int(finger.face.removeprefix("edge-")), offset)
    tx, ty = TANGENTS[finger.face]
    nx, ny = ty, -tx
    vertical = finger.face in ("left", "right")
    depth = body.half_width if vertical else body.face_half_length
    reach = body.face_half_length if vertical else body.half_width
    anchor = (-depth * nx + offset * tx, -depth * ny + offset * ty)
    return ContactFrame(anchor, (tx, ty), (nx, ny), -reach - offset, reach - offset)


def _round_frame(radius: float, tangent: Point, offset: float) -> ContactFrame:
    """A circle: the face has no end, and the offset is an arc."""
    axes = np.array([tangent, (tangent[1], -tangent[0])])
    start = slide(-radius * axes[1], axes, (1.0 / radius,), [offset])
    (x, y), ((tx, ty), (nx, ny)) = (part.tolist() for part in start)
    return ContactFrame((x, y), (tx, ty), (nx, ny), -math.inf, math.inf, 1.0 / radius)


def _edge_frame(body: ObjectParameters, edge: int, offset: float) -> ContactFrame:
    """The object is to the left of the line from corner K to the next; the tangent is opposite."""
    (x0, y0), (x1, y1) = body.corners[edge], body.corners[(edge + 1) % len(body.corners)]
    length = math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    tx, ty = (x0 - x1) / length, (y0 - y1) / length
    anchor = (0.5 * (x0 + x1) + offset * tx, 0.5 * (y0 + y1) + offset * ty)
    return ContactFrame(anchor, (tx, ty), (ty, -tx), -0.5 * length - offset, 0.5 * length - offset)


def tip_distance(scenario: PlanarScenario, index: int) -> float:
    """Distance from the base of a finger to its contact point in the start pose [m]."""
    return math.hypot(*planar_tip_at_start(scenario, index))


def planar_tip_at_start(scenario: PlanarScenario, index: int) -> Point:
    """Position of a fingertip in the start pose, relative to the base of its finger [m]."""
    finger = scenario.fingers[index]
    ax, ay = contact_frame(scenario.object, finger).anchor
    x, y, angle = scenario.trajectory.start
    tip_x = x + math.cos(angle) * ax - math.sin(angle) * ay
    tip_y = y + math.sin(angle) * ax + math.cos(angle) * ay
    return tip_x - finger.base[0], tip_y - finger.base[1]
