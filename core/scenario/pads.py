"""Soft fingertips: resistance of their pads to rotation on a face.

A pad of radius a with normal force F_n bears a moment up to e mu F_n about the normal without
tangential force, a tangential force up to mu F_n without a moment, and combinations within the
ellipsoid between them. The eccentricity e [m] depends on the distribution of pressure over the pad:
e = int r p dA / int p dA, which is 2/3 a for even pressure and 3 pi / 16 a for Hertzian pressure.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from annotated_types import Interval

from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.space import SPATIAL

PAD_FACTORS = {"even": 2.0 / 3.0, "hertz": 3.0 * math.pi / 16.0}
"""Eccentricity divided by the radius of the pad, by distribution of pressure."""

LEAST_ECCENTRICITY = 5e-4
"""Smaller pads are points: they would turn and slide at speeds that count as rest [m]."""

PadRadius = Annotated[
    float,
    Interval(ge=0.0, le=1.0),
    Quantity(
        "Radius of the pad of a soft fingertip, which resists rotation about the normal of the "
        "face; a pad with an eccentricity below 0.5 mm (a radius below 0.75 mm, with hertz "
        "0.85 mm) is a hard point, which turns freely.",
        "m",
        typical=(0.0, 0.03),
        hands=(SPATIAL,),
    ),
]
PadPressure = Annotated[
    Literal["even", "hertz"],
    Quantity(
        "Distribution of pressure over the pad, which determines the ratio of the largest moment "
        "to the largest force: even (2/3 of the radius) or hertz (0.589 of the radius).",
        hands=(SPATIAL,),
    ),
]


def eccentricity(radius: float, pressure: str) -> float:
    """Ratio of the largest moment to the largest force of a pad; 0 for a point [m].

    Args:
        radius: Radius of the pad [m].
        pressure: A key of `PAD_FACTORS`.
    """
    reach = PAD_FACTORS[pressure] * radius
    return reach if reach >= LEAST_ECCENTRICITY else 0.0
