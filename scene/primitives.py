"""Drawing primitives: shapes in the axes of a frame, with roles that determine their colours."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.scene.rotations import Values
from slipgrasp.scene.skeleton import Moving
from slipgrasp.scene.states import States


class Role(StrEnum):
    """Roles of primitives with a fixed colour."""

    OBJECT = "object"
    OBJECT_EDGE = "object edge"
    DESIRED = "desired"
    LINK = "link"
    JOINT = "joint"
    MOUNT = "mount"
    CONE = "cone"


Paint = Role | Callable[[States], NDArray[np.int8]]
"""A role, or phases that determine the colours of a primitive, shape ``(n,)``."""


class Triangles(NamedTuple):
    """Triangles between points ``(k, 3)`` [m], indices ``(m, 3)`` counterclockwise from outside."""

    paint: Paint
    points: Values
    indices: NDArray[np.int64]


class Lines(NamedTuple):
    """Segments between points ``(k, 3)`` or moving ``(n, k, 3)`` [m], by indices ``(m, 2)``."""

    paint: Paint
    points: Values | Moving
    indices: NDArray[np.int64]
    thickness: float
    dashed: bool = False


class Rod(NamedTuple):
    """A round bar between two points, with a radius at each end [m].

    If it is rounded, its ends are half balls beyond those points.
    """

    paint: Paint
    start: Values
    end: Values
    radii: tuple[float, float]
    rounded: bool = False


class Ball(NamedTuple):
    """A ball."""

    paint: Paint
    centre: Values
    radius: float


class Arrow(NamedTuple):
    """An arrow along a moving vector ``(n, 3)`` from a point, with a shaft and a head [m]."""

    paint: Paint
    tail: Values
    vector: Moving
    shaft_diameter: float
    head_length: float
    head_diameter: float


class Cone(NamedTuple):
    """A circular cone from the origin along z: moving half angle ``(n,)``, slant height [m]."""

    paint: Paint
    half_angle: Moving
    slant: float


Shape = Triangles | Lines | Rod | Ball | Arrow | Cone


class Entity(NamedTuple):
    """Primitives in the axes of a frame, which they follow."""

    name: str
    frame: str
    shapes: tuple[Shape, ...]
