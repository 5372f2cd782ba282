"""The pad of a soft fingertip: a disc on the face, with a pointer that turns with the fingertip.

The pointer is a line from the centre of the disc to its edge, initially along t_x.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.states import States


class Pad(NamedTuple):
    """A pad of one contact.

    Attributes:
        contact: The contact.
        radius: Radius of the disc [m].
        eccentricity: Ratio of the largest moment to the largest tangential force [m].
    """

    contact: int
    radius: float
    eccentricity: float

    def hand(self, states: States) -> Values:
        """The end of the pointer from the centre, along (t_x, t_y), shape ``(n, 2)`` [m]."""
        spin = states.spin[:, self.contact]
        return self.radius * np.stack([np.cos(spin), np.sin(spin)], axis=1)


def pad_of(scenario: Scenario, i: int) -> Pad | None:
    """The pad of contact ``i``; None for a hard one."""
    finger = scenario.fingers[i]
    if not isinstance(finger, SpatialFinger) or finger.eccentricity == 0.0:
        return None
    return Pad(i, finger.pad_radius, finger.eccentricity)
