"""The held object."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from annotated_types import Interval, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG, Length, Offset
from slipgrasp.core.scenario.parameters import Quantity, changeable

MAX_CORNERS = 12
SIDES = ("left", "right", "bottom", "top")
"""Faces of a rectangle."""

Corner = tuple[Offset, Offset]


ObjectMass = Annotated[
    float,
    Interval(ge=1e-3, le=1e3),
    changeable("True mass of the object.", "kg", typical=(0.2, 3.0)),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ObjectParameters:
    """The held object: a rectangle about its centre of mass, a convex polygon or a circle."""

    mass: ObjectMass = 1.0
    inertia: Annotated[
        float,
        Interval(ge=1e-6, le=1e3),
        changeable(
            "True moment of inertia of the object about its centre.", "kg m²", typical=(0.002, 0.05)
        ),
    ] = 0.01042
    half_width: Annotated[
        Length, Quantity("Distance of the left and right faces from the centre.", "m")
    ] = 0.1
    face_half_length: Annotated[
        Length,
        Quantity(
            "Half the length of the left and right faces; beyond it, a fingertip loses contact.",
            "m",
        ),
    ] = 0.1458
    corners: Annotated[
        tuple[Corner, ...],
        Len(0, MAX_CORNERS),
        Quantity(
            "Corners (x, y) of a convex polygon, counterclockwise, relative to its centre of mass; "
            "omitted: a rectangle.",
            "m",
        ),
    ] = ()
    shape: Annotated[
        Literal["polygon", "circle"],
        Quantity(
            "Outline of the object: polygon (a rectangle unless corners are given) or circle, "
            "centred on the centre of mass."
        ),
    ] = "polygon"
    radius: Annotated[Length, Quantity("Radius of a circle.", "m")] = 0.1

    @property
    def is_round(self) -> bool:
        """Whether the faces are curved."""
        return self.shape == "circle"

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half the sizes along x and y of a rectangle, or of the square around a circle [m]."""
        if self.is_round:
            return self.radius, self.radius
        return self.half_width, self.face_half_length

    # Half the thickness of the object perpendicular to its plane: infinite [m].
    half_height = math.inf

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the faces: by side, or edge-0, edge-1 … of a polygon.

        A circle has only one face: its four names are the origins of the contact offset.
        """
        return tuple(f"edge-{k}" for k in range(len(self.corners))) or SIDES
