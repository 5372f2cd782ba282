"""Bounded numbers that several parts of a scenario share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal, Protocol

from annotated_types import Interval
from pydantic import ConfigDict

MAX_FINGERS = 6

CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _HasItems(Protocol):
    def items(self) -> Iterable[tuple[str, Any]]: ...


class _HashedItems:
    """A mapping with a hash."""

    def __hash__(self: _HasItems) -> int:
        return hash(frozenset(self.items()))


class FrozenMapping(_HashedItems, dict[str, Any]):
    """Immutable named values, so that scenarios can be keys of a cache."""


Coordinate = Annotated[float, Interval(ge=-1e3, le=1e3)]
Offset = Annotated[float, Interval(ge=-10.0, le=10.0)]
Length = Annotated[float, Interval(ge=1e-3, le=10.0)]
Angle = Annotated[float, Interval(ge=-3.2, le=3.2)]
Fraction = Annotated[float, Interval(ge=0.0, le=1.0)]
# Moment of inertia of a link, divided by mass times length squared.
InertiaFraction = Annotated[float, Interval(ge=1e-6, le=1.0)]

# Faces of a rectangle by name; edge-K of a polygon runs from corner K to the next one.
Face = Literal[
    "left",
    "right",
    "bottom",
    "top",
    "edge-0",
    "edge-1",
    "edge-2",
    "edge-3",
    "edge-4",
    "edge-5",
    "edge-6",
    "edge-7",
    "edge-8",
    "edge-9",
    "edge-10",
    "edge-11",
]

# side-K of an object runs from corner K to the next one.
SpatialFace = Literal[
    "side-0",
    "side-1",
    "side-2",
    "side-3",
    "side-4",
    "side-5",
    "side-6",
    "side-7",
    "side-8",
    "side-9",
    "side-10",
    "side-11",
    "top",
    "bottom",
]
