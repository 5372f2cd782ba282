"""Random hands, as they are drawn for flat faces, around a round object."""

from __future__ import annotations

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_from_mapping


def with_round_object(scenario: Scenario, shape: str, radius: float) -> Scenario:
    """The same hand, motion and law without what round objects do not have: corners, patches.

    Args:
        scenario: Of a rectangle, a box or a prism.
        shape: What it becomes.
        radius: Its radius [m].
    """
    mapping = scenario.to_mapping()
    mapping["object"] |= {"shape": shape, "radius": radius, "corners": []}
    mapping["patches"] = []
    changes = mapping.get("changes", ())
    mapping["changes"] = [each for each in changes if "patches" not in each["parameter"]]
    return scenario_from_mapping(mapping)
