"""The desired motion of the object."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le
from pydantic.dataclasses import dataclass

from core.parameters import Quantity
from core.scenario.field_types import CONFIG, Coordinate

__all__ = ["TrajectoryParameters"]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class TrajectoryParameters:
    """The desired motion of the object: accelerate, coast, brake, then rest (Eq. 64)."""

    start: Annotated[
        tuple[Coordinate, Coordinate, Annotated[float, Ge(-3.2), Le(3.2)]],
        Quantity("Object pose (x, y, theta) at the start, desired and actual.", "m, m, rad"),
    ] = (1.466, 0.366, 0.0)
    acceleration: Annotated[
        tuple[
            Annotated[float, Ge(-100.0), Le(100.0)],
            Annotated[float, Ge(-100.0), Le(100.0)],
            Annotated[float, Ge(-100.0), Le(100.0)],
        ],
        Quantity(
            "Desired acceleration (x, y, theta) while speeding up; its opposite while braking.",
            "m/s^2, m/s^2, rad/s^2",
        ),
    ] = (0.0, 0.0256, 0.0)
    acceleration_time: Annotated[
        float, Ge(0.0), Le(1e3), Quantity("How long it speeds up, and how long it brakes.", "s")
    ] = 1.0
    coast_time: Annotated[
        float, Ge(0.0), Le(1e3), Quantity("How long it moves at constant speed in between.", "s")
    ] = 5.0
