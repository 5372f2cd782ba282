"""Contact points and their frames on flat and curved faces (docs/space.md, Round objects).

A face has a curvature kappa [1/m] along each tangent: all are 0 (flat), one is nonzero (a circle,
the side of a cylinder), or two are equal and nonzero (a sphere). The inward normal n points to the
centre of curvature.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

FARTHEST = 7.0
"""Coordinates at the end of the face of a sphere, in radii: 148 degrees from the anchor.

Coordinates diverge at the point opposite the anchor.
"""


def slide(
    anchor: ArrayLike, axes: ArrayLike, curvatures: Sequence[float], slips: ArrayLike
) -> tuple[Floats, Floats]:
    """Returns contact points after slips, with their tangents and normals.

    Args:
        anchor: Contact point at zero slip, shape ``(d,)`` [m].
        axes: Tangents and inward normal at the anchor as rows, shape ``(d, d)``.
        curvatures: Curvatures along the tangents [1/m].
        slips: Slips along the tangents, shape ``(..., d - 1)`` [m]; on a sphere, coordinates.

    Returns:
        Points ``(..., d)`` [m] and axes ``(..., d, d)``.
    """
    start, frame = np.asarray(anchor, float), np.asarray(axes, float)
    slip = np.asanyarray(slips) * 1.0  # floats, or the numbers by which a page traces formulas
    curved = [axis for axis, curvature in enumerate(curvatures) if curvature > 0.0]
    if len(curved) > 1:
        return _slide_on_sphere(start, frame, curvatures[0], slip)
    turned = np.zeros_like(slip, shape=(*slip.shape[:-1], *frame.shape)) + frame
    points = start + slip @ frame[:-1]
    for axis in curved:
        radius, along = 1.0 / curvatures[axis], slip[..., axis, None]
        sine, cosine = np.sin(along / radius), np.cos(along / radius)
        turned[..., axis, :] = cosine * frame[axis] + sine * frame[-1]
        turned[..., -1, :] = cosine * frame[-1] - sine * frame[axis]
        points += (radius * sine - along) * frame[axis] + radius * (1.0 - cosine) * frame[-1]
    return points, turned


def _slide_on_sphere(
    anchor: Floats, frame: Floats, curvature: float, slip: Floats
) -> tuple[Floats, Floats]:
    """The same for a sphere; the tangents point along the lines of stereographic coordinates."""
    squared = (slip * slip).sum(axis=-1, keepdims=True)
    way = slip @ frame[:-1] + 0.5 * curvature * squared * frame[-1]
    way = way / (1.0 + 0.25 * curvature * curvature * squared)
    leaning = frame[-1] - 0.5 * curvature * way
    tangents = frame[:-1] + curvature * slip[..., :, None] * leaning[..., None, :]
    normal = frame[-1] - curvature * way
    return anchor + way, np.concatenate([tangents, normal[..., None, :]], axis=-2)


def coordinates_on_sphere(curvature: float, arcs: ArrayLike) -> Floats:
    """Returns the coordinates of the point at the end of an arc from the anchor.

    Args:
        curvature: Curvature of the sphere [1/m].
        arcs: Vectors with the direction and length of the arcs, shape ``(..., 2)`` [m].
    """
    arc = np.asarray(arcs, float)
    half = 0.5 * curvature * np.linalg.norm(arc, axis=-1, keepdims=True)
    return arc * (np.tan(half) / np.where(half > 0.0, half, 1.0) + (half == 0.0))


def slips_of(
    anchor: ArrayLike, axes: ArrayLike, curvatures: Sequence[float], points: Floats, near: Floats
) -> Floats:
    """Returns the slips that lead to points of a cylinder or a sphere about the origin.

    Args:
        anchor: Contact point at zero slip, shape ``(3,)`` [m].
        axes: Tangents and inward normal at the anchor as rows, shape ``(3, 3)``.
        curvatures: Curvatures along both tangents [1/m].
        points: Points on the surface, shape ``(..., 3)`` [m].
        near: Approximate slips ``(..., 2)``, which determine the number of turns on a cylinder [m].
    """
    along = points @ np.asarray(axes).T
    if curvatures[0] > 0.0:
        return along[..., :2] * (2.0 / (1.0 - curvatures[0] * along[..., 2:]))
    radius = 1.0 / curvatures[1]
    arc, turn = radius * np.arctan2(along[..., 1], -along[..., 2]), 2.0 * np.pi * radius
    arc += turn * np.round((near[..., 1] - arc) / turn)
    return np.stack([along[..., 0] - np.asarray(anchor) @ np.asarray(axes)[0], arc], axis=-1)


def turned_by(curvatures: Sequence[float], slips: ArrayLike) -> Floats:
    """Returns the angles by which a contact frame turns along its tangents, towards the normal.

    Args:
        curvatures: Curvatures along the tangents [1/m].
        slips: Slips along the tangents, shape ``(..., d - 1)`` [m].

    Returns:
        Components of one rotation vector, shape ``(..., d - 1)`` [rad].
    """
    angles = np.asanyarray(slips) * np.asarray(curvatures)[: np.shape(slips)[-1]]
    if len(curvatures) < 2 or curvatures[0] == 0.0:
        return angles
    # Coordinates on a sphere are 2 R tan(angle / 2).
    half = 0.5 * np.linalg.norm(angles, axis=-1, keepdims=True)
    return angles * (np.arctan(half) / np.where(half > 0.0, half, 1.0) + (half == 0.0))
