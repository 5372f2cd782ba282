"""Distance of an object from its target, if it is worth reporting."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slipgrasp.core.scenario import ObjectParameters
from slipgrasp.core.scenario.geometry import outline, smallest_extent
from slipgrasp.core.scenario.space import space_of_errors
from slipgrasp.core.scenario.spatial import SpatialObject
from slipgrasp.core.scenario.spatial_geometry import base_corners
from slipgrasp.core.words.phrases import joined

# Fractions of the object's smallest extent.
_FAR_OFF = 0.1
_LARGE = 0.05
_WORTH_TELLING = 1e-3  # [m]
_LASTING = 0.99  # fraction of the earlier distance


def is_far_off(body: ObjectParameters | SpatialObject, error: Sequence[float]) -> bool:
    """Whether an object is off its desired pose by more than a tenth of its size.

    Args:
        body: The object.
        error: Desired minus actual pose: x, y, theta [m, m, rad], or six coordinates.
    """
    return bool(_offsets(body, error, _FAR_OFF))


def describe_offset(body: ObjectParameters | SpatialObject, error: Sequence[float]) -> str:
    """Distance of an object from its target, such as ``34 mm from its target``; empty if small.

    Args:
        body: The object.
        error: Desired minus actual pose: x, y, theta [m, m, rad], or six coordinates.
    """
    offsets = _offsets(body, error, _LARGE)
    return f"{joined(offsets)} from its target" if offsets else ""


def is_large(body: ObjectParameters | SpatialObject, length: float) -> bool:
    """Whether a length is more than a twentieth of an object's smallest extent."""
    return length > _LARGE * _extent(body)


def describe_lasting_error(error: Sequence[float], earlier: Sequence[float]) -> str:
    """Distance of an object that hardly approaches its target; empty if small or decreasing.

    Args:
        error: Desired minus actual pose: x, y, theta [m, m, rad], or six coordinates.
        earlier: The error shortly before.
    """
    count = space_of_errors(len(error)).num_positions
    distance, before = math.hypot(*error[:count]), math.hypot(*earlier[:count])
    lasts = distance >= _WORTH_TELLING and distance >= _LASTING * before
    return _rounded(distance) if lasts else ""


def _offsets(
    body: ObjectParameters | SpatialObject, error: Sequence[float], fraction: float
) -> list[str]:
    """The distance, and the angle if it moves a corner as far; above a fraction of the extent."""
    if isinstance(body, SpatialObject):
        distance, angle = math.hypot(*error[:3]), math.hypot(*error[3:])
        corners = np.array(base_corners(body))
        radius = math.hypot(float(np.hypot(*corners.T).max()), body.half_height)
    else:
        distance, angle = math.hypot(*error[:2]), error[2]
        radius = float(np.hypot(*outline(body).T).max())
    limit = fraction * _extent(body)
    return [
        *[_rounded(distance)] * (distance > limit),
        *[f"{abs(math.degrees(angle)):.0f}°"] * (abs(angle) * radius > limit),
    ]


def _extent(body: ObjectParameters | SpatialObject) -> float:
    """The smallest extent of an object [m]."""
    if isinstance(body, SpatialObject):
        across = np.ptp(np.array(base_corners(body)), axis=0).min()
        return min(float(across), 2.0 * body.half_height)
    return smallest_extent(body)


def _rounded(distance: float) -> str:
    """A length in whole millimetres, or with two digits if that is more precise."""
    millimetres = 1e3 * distance
    return f"{millimetres:.0f} mm" if millimetres >= 10.0 else f"{millimetres:.2g} mm"
