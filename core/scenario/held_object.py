"""The held object."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG
from slipgrasp.core.scenario.parameters import Quantity

MAX_CORNERS = 12

Corner = tuple[Annotated[float, Ge(-10.0), Le(10.0)], Annotated[float, Ge(-10.0), Le(10.0)]]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ObjectParameters:
    """The held object: a rectangle about its centre of mass, or a convex polygon."""

    mass: Annotated[
        float,
        Ge(1e-3),
        Le(1e3),
        Quantity("True mass of the object.", "kg", typical=(0.2, 3.0), changeable=True),
    ] = 1.0
    inertia: Annotated[
        float,
        Ge(1e-6),
        Le(1e3),
        Quantity(
            "True moment of inertia of the object about its centre.",
            "kg m²",
            typical=(0.002, 0.05),
            changeable=True,
        ),
    ] = 0.01042
    half_width: Annotated[
        float,
        Ge(1e-3),
        Le(10.0),
        Quantity("Distance from the centre to the left and right face.", "m"),
    ] = 0.1
    face_half_length: Annotated[
        float,
        Ge(1e-3),
        Le(10.0),
        Quantity(
            "Half the length of the left and right face; a fingertip beyond it has left.", "m"
        ),
    ] = 0.1458
    corners: Annotated[
        tuple[Corner, ...],
        Len(0, MAX_CORNERS),
        Quantity(
            "Corners (x, y) of a convex polygon, counterclockwise, from its centre of mass; none: "
            "a rectangle.",
            "m",
        ),
    ] = ()
