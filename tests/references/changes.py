"""A scenario as its timed changes have made it at some time."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values


def scenario_at(scenario: Scenario, t: float) -> Scenario:
    """The scenario with the changes up to a time, those of one instant together, and no others."""
    due = sorted((c for c in scenario.changes if c.time <= t), key=lambda c: c.time)
    present = replace(scenario, changes=())
    for _, at_once in groupby(due, key=lambda c: c.time):
        present = with_values(present, {c.parameter: c.value for c in at_once})
    return present
