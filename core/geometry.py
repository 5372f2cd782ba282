"""Where fingers stand, and where their tips touch the object (docs/model.md, Contact)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.scenario import FingerParameters, ObjectParameters, Scenario

__all__ = ["ContactFrame", "contact_frame", "joint_points", "tip_distance"]


class ContactFrame(NamedTuple):
    """Anchor, tangent and inward normal of a contact in the object frame, and its slip range.

    Attributes:
        anchor: Contact point at zero slip (x, y) [m].
        tangent: Unit vector of positive slip; the normal is the tangent turned by -90 degrees.
        normal: Unit vector into the object.
        slip_minimum: Slip at which the fingertip passes the end of the face [m].
        slip_maximum: The same at the other end [m].
    """

    anchor: tuple[float, float]
    tangent: tuple[float, float]
    normal: tuple[float, float]
    slip_minimum: float
    slip_maximum: float


_TANGENTS = {
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
    "bottom": (-1.0, 0.0),
    "top": (1.0, 0.0),
}


def contact_frame(body: ObjectParameters, finger: FingerParameters) -> ContactFrame:
    """The frame in which a fingertip slides on its face.

    Args:
        body: The rectangular object.
        finger: The finger that touches it.
    """
    tx, ty = _TANGENTS[finger.face]
    nx, ny = ty, -tx
    vertical = finger.face in ("left", "right")
    depth = body.half_width if vertical else body.face_half_length
    reach = body.face_half_length if vertical else body.half_width
    offset = finger.contact_offset
    anchor = (-depth * nx + offset * tx, -depth * ny + offset * ty)
    return ContactFrame(anchor, (tx, ty), (nx, ny), -reach - offset, reach - offset)


def joint_points(
    finger: FingerParameters, joint_positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where the base, the joints and the tip of a finger stand, shape ``(..., joints + 1, 2)`` [m].

    Args:
        finger: Base and link lengths.
        joint_positions: Joint angles, each relative to the link before, ``(..., joints)`` [rad].
    """
    angles = np.cumsum(joint_positions, axis=-1)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    links = np.asarray(finger.link_lengths)[:, None] * directions
    base = np.broadcast_to(np.asarray(finger.base), (*angles.shape[:-1], 1, 2))
    return np.concatenate([base, base + np.cumsum(links, axis=-2)], axis=-2)


def tip_distance(scenario: Scenario, index: int) -> float:
    """Distance from the base of a finger to its contact point in the start pose [m]."""
    finger = scenario.fingers[index]
    ax, ay = contact_frame(scenario.object, finger).anchor
    x, y, angle = scenario.trajectory.start
    tip_x = x + math.cos(angle) * ax - math.sin(angle) * ay
    tip_y = y + math.sin(angle) * ax + math.cos(angle) * ay
    return math.hypot(tip_x - finger.base[0], tip_y - finger.base[1])
