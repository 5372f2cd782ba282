"""Scenarios of all kinds, and the unions of their parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario.controller import ControllerParameters, SpatialController
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.motion import (
    SetPoint,
    SpatialSetPoint,
)
from slipgrasp.core.scenario.planar import PlanarScenario, full_planar_scenario
from slipgrasp.core.scenario.rail import (
    RailObject,
    RailScenario,
    RailSetPoint,
    full_rail_scenario,
)
from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT, Space
from slipgrasp.core.scenario.spatial import SpatialObject, SpatialScenario, full_spatial_scenario
from slipgrasp.core.scenario.supported import (
    SupportedObject,
    SupportScenario,
    full_support_scenario,
)
from slipgrasp.core.scenario.world import Patch, Pulse, SpatialPatch, SpatialPulse

HandScenario = PlanarScenario | SpatialScenario
FreeScenario = SupportScenario | RailScenario
Scenario = HandScenario | FreeScenario
AnyScenario = TypeVar("AnyScenario", bound=Scenario)
AnyObject = ObjectParameters | SpatialObject | SupportedObject | RailObject
AnySetPoint = SetPoint | SpatialSetPoint | RailSetPoint
AnyController = ControllerParameters | SpatialController
AnyPulse = Pulse | SpatialPulse
AnyPatch = Patch | SpatialPatch

SCENARIOS: Mapping[Space, type[Scenario]] = {
    PLANAR: PlanarScenario,
    SPATIAL: SpatialScenario,
    SUPPORT: SupportScenario,
    RAIL: RailScenario,
}
_FULL = {
    PLANAR: full_planar_scenario,
    SPATIAL: full_spatial_scenario,
    SUPPORT: full_support_scenario,
    RAIL: full_rail_scenario,
}


def full_scenario(space: Space = PLANAR) -> Scenario:
    """A scenario with an item in every list; not for simulation."""
    return _FULL[space]()


def of_hand(scenario: Scenario) -> HandScenario:
    """The scenario of a hand, for code that is not used without one."""
    assert not isinstance(scenario, FreeScenario), "this scenario has no hand"
    return scenario


def need_hand(scenario: Scenario, what: str, instead: str) -> HandScenario:
    """Returns the scenario if it has a hand.

    Args:
        scenario: The scenario.
        what: What needs a hand, as the subject of a sentence.
        instead: Way out.

    Raises:
        ScenarioError: If it is a body on a support or a rail.
    """
    if isinstance(scenario, FreeScenario):
        field = scenario.space.name
        message = f"{what} needs a hand, but this is a body on a {field}; {instead}"
        raise ScenarioError([FieldError(field, None, "a hand", message)])
    return scenario


def without_events(scenario: AnyScenario) -> AnyScenario:
    """The scenario without pulses, patches and timed changes."""
    if isinstance(scenario, RailScenario):
        return replace(scenario, changes=())
    if isinstance(scenario, SupportScenario):
        return replace(scenario, pulses=(), changes=())
    return replace(scenario, pulses=(), patches=(), changes=())


def space_of(mapping: Mapping[str, object]) -> Space:
    """The kind of scenario in plain values: a support, a rail, or a planar or spatial hand."""
    if "support" in mapping:
        return SUPPORT
    if "rail" in mapping:
        return RAIL
    body = mapping.get("object")
    names = body if isinstance(body, dict) else {}
    return PLANAR if {"height", "inertias"}.isdisjoint(names) else SPATIAL


def is_there(patch: AnyPatch, t: float) -> bool:
    """Whether a patch exists at a time [s]."""
    return patch.start_time <= t and (patch.end_time is None or t < patch.end_time)


def is_acting(pulse: AnyPulse, t: float) -> bool:
    """Whether a pulse acts at a time [s]."""
    return pulse.time <= t < pulse.time + pulse.duration
