"""The upright plane of the initial view."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slipgrasp.scene.rotations import Values

Vector = tuple[float, float, float]


class ViewPlane(NamedTuple):
    """Axes of the image in the world: right, up, and towards the viewer."""

    right: Vector
    up: Vector
    towards: Vector

    @classmethod
    def seen_from(cls, azimuth: float, elevation: float) -> ViewPlane:
        """The plane perpendicular to a line of sight.

        Args:
            azimuth: Azimuth of the viewer about the vertical, from the x axis [rad].
            elevation: Elevation of the viewer above the horizon [rad].
        """
        high, low = math.sin(elevation), math.cos(elevation)
        c, s = math.cos(azimuth), math.sin(azimuth)
        return cls((-s, c, 0.0), (-high * c, -high * s, low), (low * c, low * s, high))

    def project(self, points: Values) -> Values:
        """Projections of world points ``(..., 3)`` to the plane, ``(..., 2)`` [m]."""
        return points @ np.array([self.right, self.up]).T

    def place(self, point: Values | tuple[float, float], depth: float = 0.0) -> Vector:
        """The world point of (right, up) in the plane, ``depth`` nearer to the viewer [m]."""
        along, up = point[0], point[1]
        axes = zip(self.right, self.up, self.towards, strict=True)
        x, y, z = (along * a + up * b + depth * c for a, b, c in axes)
        return (x, y, z)


FRONT = ViewPlane((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
"""The plane of planar hands: x to the right, y up."""
