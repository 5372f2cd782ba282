"""Disturbances of a run: pushes and low-friction patches set by the user."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from typing import Any, Literal

from slipgrasp.core.scenario import PLANAR, RAIL, Patch, Scenario, Space, SpatialScenario
from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.scenario.scenario import AnyPatch, AnyPulse, full_scenario, need_hand
from slipgrasp.core.scenario.world import SpatialPatch


class DisturbanceKind(StrEnum):
    """Kind of disturbance."""

    PUSH = "push"
    LOW_FRICTION_PATCH = "wet patch"
    POUR = "pour"


def is_offered(kind: DisturbanceKind, space: Space) -> bool:
    """Whether a kind of scenario has a disturbance: patches are on faces, a rail has no pushes."""
    if kind is DisturbanceKind.PUSH:
        return space is not RAIL
    return space.has_hand or kind is DisturbanceKind.POUR


DisturbanceList = Literal["pulses", "patches"]

_LISTS: tuple[DisturbanceList, ...] = ("pulses", "patches")


@dataclass(frozen=True, slots=True)
class Disturbance:
    """A push or a low-friction patch; its values may be out of bounds.

    Attributes:
        place: The list of the scenario that contains it.
        values: Its values by key, relative to the list item; None is omitted.
    """

    place: DisturbanceList
    values: Mapping[str, Any]

    @property
    def time(self) -> float:
        """Its start time [s]."""
        return float(self.values["time" if self.place == "pulses" else "start_time"])

    def edited(self, key: str, value: object) -> Disturbance:
        """The disturbance with one of its values replaced."""
        return replace(self, values={**self.values, key: value})


def push_at(
    time: float, space: Space = PLANAR, force: tuple[float, ...] | None = None
) -> Disturbance:
    """A push with default duration from a time [s].

    Args:
        time: Start time [s].
        space: Kind of hand.
        force: Force, a number per direction [N]; the default if None.
    """
    pulse = _plain_values(replace(full_scenario(space).pulses[0], time=time))
    own = {f"force.{i}": value for i, value in enumerate(force or ())}
    return Disturbance("pulses", pulse | own)


def low_friction_patch(
    scenario: Scenario, contact: int, slip: Sequence[float], time: float
) -> Disturbance:
    """A low-friction patch under a fingertip.

    Args:
        scenario: The scenario.
        contact: Index of the fingertip.
        slip: Slip along the tangents of its face, ``(tangents,)`` [m].
        time: Time at which the patch appears [s].
    """
    scenario = need_hand(scenario, "a low-friction patch", "set support.friction instead")
    if isinstance(scenario, SpatialScenario):
        touching = scenario.fingers[contact]
        x, y = (round(sum(pair), 6) for pair in zip(touching.contact_offset, slip, strict=True))
        patch = SpatialPatch(face=touching.face, centre=(x, y), start_time=time)
    else:
        finger = scenario.fingers[contact]
        centre = round(finger.contact_offset + slip[0], 6)
        patch = Patch(face=finger.face, centre=centre, start_time=time)
    return Disturbance("patches", _plain_values(patch))


def disturbances_of(scenario: Scenario) -> tuple[Disturbance, ...]:
    """The disturbances of a scenario: pushes, then low-friction patches."""
    return tuple(
        Disturbance(place, _plain_values(entry))
        for place in _LISTS
        for entry in getattr(scenario, place)
    )


def disturbance_words(disturbance: Disturbance) -> str:
    """Describes a disturbance, such as ``push (0, -5) N for 0.05 s``."""
    values = disturbance.values
    if disturbance.place == "pulses":
        force, moment = _vector(values, "force"), _vector(values, "moment")
        turning = f" and {_vector_words(moment)} N m" if any(moment) else ""
        return f"push {_vector_words(force)} N{turning} for {values['duration']:g} s"
    face = str(values["face"]).replace("-", " ")
    until = "" if values["end_time"] is None else f" until {values['end_time']} s"
    return f"low-friction patch on {face}, friction × {values['friction_factor']:g}{until}"


def _vector(values: Mapping[str, Any], name: str) -> list[float]:
    return [value for key, value in values.items() if key.partition(".")[0] == name]


def _vector_words(vector: Sequence[float]) -> str:
    words = ", ".join(f"{value + 0.0:g}" for value in vector)
    return words if len(vector) == 1 else f"({words})"


def is_of_disturbance(key: str) -> bool:
    """Whether a dotted key belongs to a push or a low-friction patch."""
    return key.partition(".")[0] in _LISTS


def disturbance_values(disturbances: Sequence[Disturbance]) -> Iterator[tuple[str, Any]]:
    """The values of all disturbances by dotted key of the scenario."""
    counts = dict.fromkeys(_LISTS, 0)
    for disturbance in disturbances:
        index = counts[disturbance.place]
        counts[disturbance.place] += 1
        for key, value in disturbance.values.items():
            yield f"{disturbance.place}.{index}.{key}", value


def disturbance_parameters(
    disturbances: Sequence[Disturbance], space: Space
) -> Iterator[Parameter]:
    """The parameters of all disturbances, in the order of their fields.

    Args:
        disturbances: The disturbances.
        space: Kind of hand.
    """
    templates = template_keys(space)
    for key, value in disturbance_values(disturbances):
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        template = templates.get(template_key(key, space))
        if template is not None:
            yield replace(template, key=key, value=float(value) if is_whole else value)


def _plain_values(entry: AnyPulse | AnyPatch) -> dict[str, Any]:
    """The values of a list item by key; a vector has a key per component."""
    values: dict[str, Any] = {}
    for name, value in asdict(entry).items():
        if isinstance(value, tuple):
            values |= {f"{name}.{i}": item for i, item in enumerate(value)}
        else:
            values[name] = value
    return values
