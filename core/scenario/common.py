"""Common parts of planar and spatial scenarios: lists, and names by face."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, TypeVar

from annotated_types import Len

from slipgrasp.core.scenario.controller import Estimate
from slipgrasp.core.scenario.field_types import MAX_FINGERS
from slipgrasp.core.scenario.numerics import Change
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.world import MAX_PATCHES

MAX_UNKNOWNS = 32
MAX_DIAGNOSTICS = 8
MAX_LAW_PARAMETERS = 64

FrictionCone = Literal["line", "cone", "pyramid"]
"""Bound of the tangential force of a contact; a line has two ends."""

_Entry = TypeVar("_Entry")

Title = Annotated[str, Len(0, 200), Quantity("Title of the scenario, a sentence.")]
Fingers = Annotated[tuple[_Entry, ...], Len(2, MAX_FINGERS)]
Estimates = Annotated[tuple[Estimate, ...], Len(0, MAX_UNKNOWNS)]
Pulses = Annotated[tuple[_Entry, ...], Len(0, 100)]
Patches = Annotated[tuple[_Entry, ...], Len(0, MAX_PATCHES)]
Changes = Annotated[tuple[Change, ...], Len(0, 1000)]


def names_by_face(faces: Sequence[str]) -> tuple[str, ...]:
    """Names of fingers: the faces that they touch, numbered if several share a face.

    The numbers of edges remain; letters then distinguish the fingers: edge 2a, edge 2b.

    Args:
        faces: The face that each finger touches.
    """
    names = [face.replace("-", " ") for face in faces]
    return tuple(
        name if names.count(name) == 1 else name + _ordinal(name, names[:i].count(name))
        for i, name in enumerate(names)
    )


def without_none(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """Returns a mapping of the items, omitting None and empty ``parameters``."""
    empty = ("parameters", {})
    return {key: value for key, value in items if value is not None and (key, value) != empty}


def _ordinal(name: str, earlier: int) -> str:
    return "abcdef"[earlier] if name[-1].isdigit() else f" {earlier + 1}"
