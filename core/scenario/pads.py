"""Soft fingertips: how much their pads resist being turned on a face.

A pad of radius a pressed with F_n carries at most the moment e mu F_n about the normal where it
carries no tangential force, |F_t| = mu F_n where it carries no moment, and both at once on the
ellipsoid between them. The eccentricity e [m] follows from how the pressure spreads over the pad:
e = int r p dA / int p dA, 2/3 a where it is even, 3 pi / 16 a where it is that of Hertz.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from annotated_types import Ge, Le

from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.space import SPATIAL

PAD_FACTORS = {"even": 2.0 / 3.0, "hertz": 3.0 * math.pi / 16.0}
"""Eccentricity over the radius of the pad, by how the pressure spreads over it."""

LEAST_ECCENTRICITY = 5e-4
"""A pad with less is a point: it would turn and slide at speeds that count as rest [m]."""

PadRadius = Annotated[
    float,
    Ge(0.0),
    Le(1.0),
    Quantity(
        "Radius of the pad of a soft fingertip, which resists turning about the normal of the "
        "face; below 1 mm: a hard point, which turns freely.",
        "m",
        typical=(0.0, 0.03),
        hands=(SPATIAL,),
    ),
]
PadPressure = Annotated[
    Literal["even", "hertz"],
    Quantity(
        "How the pressure spreads over the pad: even, greatest moment over greatest force 2/3 of "
        "its radius; hertz, as of a ball, 0.589 of it.",
        hands=(SPATIAL,),
    ),
]


def eccentricity(radius: float, pressure: str) -> float:
    """Greatest moment of a pad over its greatest force, 0 of a point [m].

    Args:
        radius: Of the pad [m].
        pressure: A key of `PAD_FACTORS`.
    """
    reach = PAD_FACTORS[pressure] * radius
    return reach if reach >= LEAST_ECCENTRICITY else 0.0
