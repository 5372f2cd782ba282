"""Desired motions of every kind whose segments end on, between and a rounding beside ticks."""

from __future__ import annotations

import math
from random import Random
from typing import Any

MOTIONS = ("coast", "set-points", "circle", "rotation", "shake", "table")
# By how much of a period, or by how many roundings, an instant misses a tick.
_ASIDE = (0.0, 0.0, 0.31, 0.77)
_ROUNDINGS = (0, -1, 1)
_MOST = 0.01  # by how much an object is moved, or turned [m], [rad]


def draw_motion(rng: Random, kind: str, pose: tuple[float, ...], period: float) -> dict[str, Any]:
    """A motion that ends within 0.3 s, as the table ``trajectory`` of a scenario.

    Args:
        rng: Where the numbers come from.
        kind: Its kind.
        pose: Where it starts: (x, y, theta) of a planar object, position and quaternion of a
            spatial one.
        period: Of the ticks [s].
    """
    dimensions = 3 if len(pose) == 3 else 6
    base = pose if dimensions == 3 else (*pose[:3], 0.0, 0.0, 0.0)

    def offset() -> list[float]:
        return [rng.uniform(-_MOST, _MOST) for _ in range(dimensions)]

    def near(time: float) -> float:
        instant = (round(time / period) + rng.choice(_ASIDE)) * period
        for _ in range(abs(rounding := rng.choice(_ROUNDINGS))):
            instant = math.nextafter(instant, math.inf * rounding)
        return instant

    first, second = ([x + y for x, y in zip(base, offset(), strict=True)] for _ in range(2))
    begin, end = near(0.02), near(0.1)
    return {
        "kind": kind,
        "start": pose,
        "acceleration": [rng.uniform(-0.5, 0.5) for _ in range(dimensions)],
        "acceleration_time": near(0.05),
        "coast_time": near(0.1),
        "period": near(0.15),
        "radius": _MOST,
        "angle": 0.05 if dimensions == 3 else [rng.uniform(-0.1, 0.1) for _ in range(3)],
        "amplitude": offset(),
        "set_points": [
            {"time": begin, "duration": end - begin, "pose": first},
            {"time": near(0.15), "duration": near(0.1), "pose": second},
        ],
        "table": [(0.0, *base), (end, *first), (near(0.2), *second)],
    }
