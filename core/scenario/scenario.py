"""Scenarios of all kinds of hands, and the unions of their parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from slipgrasp.core.scenario.controller import ControllerParameters, SpatialController
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.motion import SetPoint, TrajectoryParameters
from slipgrasp.core.scenario.planar import PlanarScenario, full_planar_scenario
from slipgrasp.core.scenario.space import PLANAR, SPATIAL, Space
from slipgrasp.core.scenario.spatial import (
    SpatialObject,
    SpatialPatch,
    SpatialPulse,
    SpatialScenario,
    SpatialSetPoint,
    SpatialTrajectory,
    full_spatial_scenario,
)
from slipgrasp.core.scenario.world import Patch, Pulse

Scenario = PlanarScenario | SpatialScenario
AnyScenario = TypeVar("AnyScenario", bound=Scenario)
AnyObject = ObjectParameters | SpatialObject
AnyTrajectory = TrajectoryParameters | SpatialTrajectory
AnySetPoint = SetPoint | SpatialSetPoint
AnyController = ControllerParameters | SpatialController
AnyPulse = Pulse | SpatialPulse
AnyPatch = Patch | SpatialPatch

SCENARIOS: Mapping[Space, type[PlanarScenario] | type[SpatialScenario]] = {
    PLANAR: PlanarScenario,
    SPATIAL: SpatialScenario,
}
_FULL = {PLANAR: full_planar_scenario, SPATIAL: full_spatial_scenario}


def full_scenario(space: Space = PLANAR) -> Scenario:
    """A scenario with an item in every list; not for simulation."""
    return _FULL[space]()


def space_of(mapping: Mapping[str, object]) -> Space:
    """The kind of hand in plain values: a spatial object has a height."""
    body = mapping.get("object")
    names = body if isinstance(body, dict) else {}
    return PLANAR if {"height", "inertias"}.isdisjoint(names) else SPATIAL


def is_there(patch: AnyPatch, t: float) -> bool:
    """Whether a patch exists at a time [s]."""
    return patch.start_time <= t and (patch.end_time is None or t < patch.end_time)


def is_acting(pulse: AnyPulse, t: float) -> bool:
    """Whether a pulse acts at a time [s]."""
    return pulse.time <= t < pulse.time + pulse.duration
