"""Closing force of a gripper: response of its drive to the commanded grip force."""

from __future__ import annotations

import math

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import exp


@compiled
def lag_share(bandwidth: float, period: float) -> float:
    """Fraction of the distance to its target that a first-order lag covers in a period.

    Args:
        bandwidth: Bandwidth of the lag [Hz].
        period: Control period [s].
    """
    return 1.0 - exp(-2.0 * math.pi * bandwidth * period)


@compiled
def approach_grip(law: Record, discrete: Record) -> None:
    """Moves the closing force by one control period towards the grip force.

    The response is a first-order lag with a limited rate.
    """
    step = law.force_share * (law.grip_force - discrete.closing_force)
    most = law.force_rate * law.period
    discrete.closing_force += min(max(step, -most), most)
