"""A hexagon held by three fingers on slanted faces, pushed and wetted for a moment."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping

CORNERS = (
    (-0.12, -0.12),
    (0.12, -0.12),
    (0.16, 0.06),
    (0.06, 0.14),
    (-0.06, 0.14),
    (-0.16, 0.06),
)


def held_polygon(duration: float = 0.1) -> Scenario:
    """The scenario: a push from 0.02 s to 0.06 s, a low-friction patch from 0.03 s on."""
    mapping: dict[str, Any] = load_scenario("paper-case-2").to_mapping()
    left, right = ({**finger, "friction": 0.5} for finger in mapping["fingers"])
    below = {"base": (0.966, -0.384), "link_lengths": (0.6, 0.5), "face": "edge-0"}
    mapping["object"] = {"mass": 1.0, "inertia": 0.011, "corners": CORNERS}
    mapping["fingers"] = [
        {**left, "face": "edge-5"},
        {**right, "face": "edge-1"},
        {**left, **below, "contact_offset": 0.01},
    ]
    mapping["controller"] |= {"control_period": 0.001}
    mapping["estimates"] = [
        {"parameter": "object.mass", "initial": 1.0},
        {"parameter": "object.inertia", "initial": 0.011},
    ]
    mapping["pulses"] = [{"time": 0.02, "duration": 0.04, "force": (3.0, -4.0), "moment": 0.1}]
    mapping["patches"] = [{"face": "edge-5", "half_length": 0.02, "start_time": 0.03}]
    mapping["simulation"]["duration"] = duration
    return scenario_from_mapping(mapping)
