"""Low-friction patches on the face of a contact, from the initial contact point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import PlanarScenario, Scenario, SpatialScenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.scenario import AnyPatch


class FacePatch(NamedTuple):
    """A patch that a fingertip can slip onto.

    Attributes:
        patch: The patch.
        centre: Its middle, as slips along the tangents, shape ``(d - 1,)`` [m].
        radius: Its radius, or half its length on a planar object [m].
    """

    patch: AnyPatch
    centre: tuple[float, ...]
    radius: float


def patches_on(scenario: Scenario, i: int) -> Iterator[FacePatch]:
    """The patches on the face that contact ``i`` touches; on a planar one, their part on the face.

    Args:
        scenario: A hand; other scenarios have no patches.
        i: Index of the contact.
    """
    if isinstance(scenario, SpatialScenario):
        for disc in scenario.patches:
            if disc.face == scenario.fingers[i].face:
                centre = np.subtract(disc.centre, scenario.fingers[i].contact_offset)
                yield FacePatch(disc, tuple(centre.tolist()), disc.radius)
    elif isinstance(scenario, PlanarScenario):
        finger = scenario.fingers[i]
        frame = contact_frame(scenario.object, finger)
        for band in scenario.patches:
            if band.face == finger.face:
                ends = band.centre - finger.contact_offset + np.array([-1, 1]) * band.half_length
                low, high = ends.clip(frame.slip_minimum, frame.slip_maximum).tolist()
                yield FacePatch(band, (0.5 * (low + high),), 0.5 * (high - low))
