"""How large things are drawn in Foxglove's 3D panel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import inner_radius

_LINK_RADIUS = 0.05
_LEAST_GRAVITY = 1.0


class Sizes(NamedTuple):
    """Sizes that follow from the scenario [m].

    Attributes:
        half_depth: How far the object reaches towards the eye.
        front: Where marks float, a little nearer to the eye.
        link_radius: Of the links at the start of the first.
        tip_radius: Of the fingertips.
        mark: Length of the edges of a friction cone.
        thickness: Of lines.
        per_newton: Length of an arrow for each newton [m/N].
    """

    half_depth: float
    front: float
    link_radius: float
    tip_radius: float
    mark: float
    thickness: float
    per_newton: float


def sizes_of(scenario: Scenario) -> Sizes:
    """Sizes that suit a hand and object of any scale.

    An arrow as long as half the object is wide stands for twice the object's weight.

    Args:
        scenario: Hand and object.
    """
    body = scenario.object
    unit = inner_radius(body)
    mean_length = float(np.mean([finger.link_lengths for finger in scenario.fingers]))
    weight = body.mass * max(scenario.simulation.gravity, _LEAST_GRAVITY)
    return Sizes(
        half_depth=0.5 * unit,
        front=0.6 * unit,
        link_radius=min(_LINK_RADIUS * mean_length, 0.5 * unit),
        tip_radius=0.22 * unit,
        mark=0.9 * unit,
        thickness=0.05 * unit,
        per_newton=0.5 * unit / weight,
    )
