"""The pad of a soft fingertip: a disc on the face, with a hand that turns as the fingertip does.

The hand is a line from the middle of the disc to its edge, along t_x at the start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.scene.states import States

Values = NDArray[np.float64]


class Pad(NamedTuple):
    """A pad of one contact.

    Attributes:
        contact: Which contact.
        radius: Of the disc [m].
        eccentricity: Greatest moment over greatest tangential force [m].
    """

    contact: int
    radius: float
    eccentricity: float

    def hand(self, states: States) -> Values:
        """The end of the hand, from the middle, in parts along (t_x, t_y), shape ``(n, 2)`` [m]."""
        spin = states.spin[:, self.contact]
        return self.radius * np.stack([np.cos(spin), np.sin(spin)], axis=1)


def pad_of(scenario: Scenario, i: int) -> Pad | None:
    """The pad of contact ``i``; None of a hard one."""
    finger = scenario.fingers[i]
    if not isinstance(finger, SpatialFinger) or finger.eccentricity == 0.0:
        return None
    return Pad(i, finger.pad_radius, finger.eccentricity)
