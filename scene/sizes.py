"""Sizes of the drawn parts, chosen for a hand and object of any scale."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import HandScenario, RailScenario, Scenario, SupportScenario
from slipgrasp.core.scenario.chain import chain_length
from slipgrasp.core.scenario.geometry import inner_radius
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.scene import skeleton

_LEAST_GRAVITY = 1.0


class Sizes(NamedTuple):
    """Sizes derived from the scenario [m].

    Attributes:
        inner_radius: Distance from the centre of mass to the nearest face.
        half_depth: Half the height of the prism; for a planar object, half its depth.
        front: Distance of marks in front of a planar hand; 0 for a spatial one, which is
            transparent.
        link_radius: Radius of the links at the start of the first one.
        tip_radius: Radius of the fingertips.
        mark: Slant height of a friction cone.
        thickness: Thickness of lines.
        per_newton: Length of an arrow per newton [m/N].
    """

    inner_radius: float
    half_depth: float
    front: float
    link_radius: float
    tip_radius: float
    mark: float
    thickness: float
    per_newton: float


def sizes_of(scenario: Scenario) -> Sizes:
    """Chooses sizes for a hand and object of any scale.

    An arrow for twice the weight (on a support: a third of it) is as long as the distance from the
    centre to the nearest face.

    Args:
        scenario: Hand and object.
    """
    unit, height = inner_radius(scenario.object), scenario.object.half_height
    weight = scenario.object.mass * max(scenario.simulation.gravity, _LEAST_GRAVITY)
    is_flat, link_radius, per_weight = math.isinf(height), 0.1 * unit, 3.0
    half_depth = 0.5 * unit if is_flat else height
    if isinstance(scenario, SupportScenario):
        half_depth, is_flat = skeleton.body_height(scenario), False
    else:
        count = len(scenario.fingers) - scenario.space.bare_contacts
        lengths = [length for i in range(count) for length in _lengths(scenario, i)]
        link_radius, per_weight = min(0.05 * float(np.mean(lengths)), unit), 0.5
    return Sizes(
        inner_radius=unit,
        half_depth=half_depth,
        front=0.6 * unit if is_flat else 0.0,
        link_radius=link_radius,
        tip_radius=0.2 * unit,
        mark=0.9 * unit,
        thickness=0.05 * unit,
        per_newton=per_weight * unit / weight,
    )


def _lengths(scenario: HandScenario | RailScenario, i: int) -> tuple[float, ...]:
    """Lengths of the links [m].

    For a chain, half its length; for slides, the distance of the tip from their origin.
    """
    finger = skeleton.mechanism_of(scenario, i)
    if i in scenario.slides:
        return (float(np.linalg.norm(skeleton.tip_at_start(of_hand(scenario), i))),)
    if (chain := skeleton.chain_of(finger)) is not None:
        return (0.5 * chain_length(chain.joints, chain.tip),)
    return finger.link_lengths
