"""A whole scenario."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

from annotated_types import Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.controller import ControllerParameters, Estimate
from slipgrasp.core.scenario.field_types import CONFIG, MAX_FINGERS
from slipgrasp.core.scenario.finger import FingerParameters
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.motion import TrajectoryParameters
from slipgrasp.core.scenario.numerics import Change, SimulationParameters
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.world import (
    MAX_PATCHES,
    ActuationParameters,
    Patch,
    Pulse,
    SensingParameters,
)

MAX_UNKNOWNS = 32
MAX_DIAGNOSTICS = 8
MAX_LAW_PARAMETERS = 64


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Scenario:
    """A hand, an object, a desired motion, a controller and its ignorance.

    Two scenarios that are equal give runs that are equal to the last bit.
    """

    title: Annotated[str, Len(0, 200), Quantity("What this scenario shows, in a sentence.")] = ""
    object: ObjectParameters = ObjectParameters()
    fingers: Annotated[tuple[FingerParameters, ...], Len(2, MAX_FINGERS)]
    trajectory: TrajectoryParameters = TrajectoryParameters()
    controller: ControllerParameters = ControllerParameters()
    estimates: Annotated[tuple[Estimate, ...], Len(0, MAX_UNKNOWNS)] = ()
    sensing: SensingParameters = SensingParameters()
    actuation: ActuationParameters = ActuationParameters()
    simulation: SimulationParameters = SimulationParameters()
    pulses: Annotated[tuple[Pulse, ...], Len(0, 100)] = ()
    patches: Annotated[tuple[Patch, ...], Len(0, MAX_PATCHES)] = ()
    changes: Annotated[tuple[Change, ...], Len(0, 1000)] = ()

    @property
    def finger_names(self) -> tuple[str, ...]:
        """What to call the fingers: the faces they touch, numbered where several share one.

        Edges have numbers themselves, there letters tell the fingers apart: edge 2a, edge 2b.
        """
        faces = [finger.face.replace("-", " ") for finger in self.fingers]
        return tuple(
            face if faces.count(face) == 1 else face + _ordinal(face, faces[:i].count(face))
            for i, face in enumerate(faces)
        )

    @property
    def in_space(self) -> bool:
        """Whether the hand stands in space and not in the plane."""
        return False

    @property
    def has_pyramid(self) -> bool:
        """Whether friction acts along each of two tangents by itself; a plane has but one."""
        return False

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, without what was left out (None, no parameters)."""
        return asdict(self, dict_factory=_without_none)


def _ordinal(face: str, earlier: int) -> str:
    return "abcdef"[earlier] if face[-1].isdigit() else f" {earlier + 1}"


def _without_none(items: list[tuple[str, Any]]) -> dict[str, Any]:
    empty = ("parameters", {})
    return {key: value for key, value in items if value is not None and (key, value) != empty}
