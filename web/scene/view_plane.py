"""The upright plane that the first look at a hand is along."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Vector = tuple[float, float, float]


class ViewPlane(NamedTuple):
    """Axes of the picture in the world: to the right, up, and towards the eye."""

    right: Vector
    up: Vector
    towards: Vector

    @classmethod
    def seen_from(cls, azimuth: float, elevation: float) -> ViewPlane:
        """The plane across a line of sight.

        Args:
            azimuth: Where the eye stands around the vertical, from the x axis [rad].
            elevation: How high it stands above the horizon [rad].
        """
        high, low = math.sin(elevation), math.cos(elevation)
        c, s = math.cos(azimuth), math.sin(azimuth)
        return cls((-s, c, 0.0), (-high * c, -high * s, low), (low * c, low * s, high))

    def project(self, points: Points) -> Points:
        """Where points of the world ``(..., 3)`` stand in the plane, ``(..., 2)`` [m]."""
        return points @ np.array([self.right, self.up]).T

    def place(self, point: Points | tuple[float, float], depth: float = 0.0) -> Vector:
        """A point (right, up) of the plane in the world, ``depth`` nearer to the eye [m]."""
        along, up = point[0], point[1]
        axes = zip(self.right, self.up, self.towards, strict=True)
        x, y, z = (along * a + up * b + depth * c for a, b, c in axes)
        return (x, y, z)


FRONT = ViewPlane((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
"""The plane of planar hands: x to the right, y up."""
