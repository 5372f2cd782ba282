"""Where the marks of a contact in space stand, in the plane of its face.

The plane is seen from outside the object: t_y points to the right, t_x up, the inward normal
away from the eye. So the slip (s_x, s_y) stands at (right, up) = (s_y, s_x), and friction on the
object, which is -F_x along t_x and -F_y along t_y, at (-F_y, -F_x).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial_geometry import SpatialContact
from slipgrasp.web.scene.space.solids import Quaternion, quaternion_of

Points = NDArray[np.float64]


class ContactState(NamedTuple):
    """One contact at one instant, in the plane of its face: right, up.

    Attributes:
        slip: Where the fingertip is, from the spot touched first [m].
        way: How it got there, shape ``(points, 2)`` [m].
        velocity: Slip velocity [m/s].
        friction: Friction on the object [N].
        normal: Normal force [N].
        coefficient: True friction coefficient.
        believed: The one the controller believes in, None if it knows the true one.
    """

    slip: Points
    way: Points
    velocity: Points
    friction: Points
    normal: float
    coefficient: float
    believed: float | None

    @property
    def limit(self) -> float:
        """Largest friction [N]."""
        return max(self.coefficient * self.normal, 0.0)


def in_face(values: Points) -> Points:
    """Components (x, y) along the tangents as (right, up), any shape ``(..., 2)``."""
    return values[..., ::-1]


def face_attitude(contact: SpatialContact) -> Quaternion:
    """What turns the model's upright plane (x, depth away, z) into the face, from outside."""
    columns = [contact.tangent_y, contact.normal, contact.tangent_x]
    return quaternion_of(np.column_stack([np.asarray(column) for column in columns]))


def way_segments(way: Points, offset: float) -> NDArray[np.float32]:
    """The way of a fingertip as segments of the plane, ``offset`` nearer to the eye [m]."""
    points = np.column_stack([way[:, 0], np.full(len(way), -offset), way[:, 1]])
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
