"""The desired motion of the object: three pieces of constant acceleration, then rest."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.records import Record
from core.scenario import TrajectoryParameters

__all__ = ["MOTION", "NUM_PIECES", "desired_motion", "pack_motion"]

NUM_PIECES = 3

MOTION = np.dtype(
    [
        ("start", np.float64, (3,)),
        ("acceleration", np.float64, (3,)),
        ("breaks", np.float64, (NUM_PIECES,)),  # ends of the pieces [s]
    ],
    align=True,
)


def pack_motion(trajectory: TrajectoryParameters, motion: np.void) -> None:
    """Writes the desired motion into ``motion``."""
    speeding, coasting = trajectory.acceleration_time, trajectory.coast_time
    motion["start"] = trajectory.start
    motion["acceleration"] = trajectory.acceleration
    motion["breaks"] = speeding, speeding + coasting, speeding + coasting + speeding


@compiled
def desired_motion(
    motion: Record, piece: int, t: float, coordinate: int
) -> tuple[float, float, float]:
    """Desired position, velocity, acceleration of one coordinate on a piece of Eq. 64.

    The piece is given, not found from ``t``, so that values at a break are one-sided.
    """
    begin = motion.start[coordinate]
    slope = motion.acceleration[coordinate]
    first, second, third = motion.breaks[0], motion.breaks[1], motion.breaks[2]
    if piece == 0:
        return begin + 0.5 * slope * t * t, slope * t, slope
    speed = slope * first
    begin += 0.5 * slope * first * first
    if piece == 1:
        return begin + speed * (t - first), speed, 0.0
    begin += speed * (second - first)
    if piece == 2:
        s = t - second
        return begin + speed * s - 0.5 * slope * s * s, speed - slope * s, -slope
    s = third - second
    return begin + speed * s - 0.5 * slope * s * s, 0.0, 0.0
