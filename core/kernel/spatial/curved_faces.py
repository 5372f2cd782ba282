"""Contacts on the side of a cylinder and on a sphere (docs/space.md, Round objects).

R is the radius; all vectors are in the axes of the given frame. A cylinder is curved along its
second tangent, along which slip is the arc length. Slip on a sphere has stereographic coordinates,
s = 2 R tan(angle / 2) along the direction from the anchor. Their only pole is opposite the anchor,
and their coordinate lines have orthogonal unit tangents t_x and t_y. The equations use the slip
velocities along these tangents; s' is (1 + |s|^2 / 4 R^2) times them.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats
from slipgrasp.core.kernel.numerics.elementary import sincos

FLAT, CYLINDER, SPHERE = range(3)


@compiled
def follow_face(
    kind: int, radius: float, first: float, second: float, frame: Floats, point: Floats
) -> None:
    """Maps a contact that has slipped on the tangent plane to the curved face.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        first: Slip along t_x [m].
        second: Slip along t_y [m].
        frame: t_x, t_y and n at the anchor, ``(3, 3)``; replaced by those at the contact.
        point: Contact on the tangent plane, ``(3,)``; replaced by the contact [m].
    """
    if kind == CYLINDER:
        sine, cosine = sincos(second / radius)
        for c in range(3):
            ty, n = frame[1, c], frame[2, c]
            frame[1, c], frame[2, c] = cosine * ty + sine * n, cosine * n - sine * ty
            point[c] += radius * (n - frame[2, c]) - second * ty
        return
    squared = first * first + second * second
    scale = 1.0 / coordinate_scale(radius, squared)
    for c in range(3):
        tx, ty, n = frame[0, c], frame[1, c], frame[2, c]
        flat = first * tx + second * ty
        way = scale * (flat + 0.5 * squared / radius * n)
        leaning = (n - 0.5 * way / radius) / radius
        frame[0, c], frame[1, c] = tx + first * leaning, ty + second * leaning
        frame[2, c] = n - way / radius
        point[c] += way - flat


@compiled
def coordinate_scale(radius: float, squared: float) -> float:
    """Rate of a coordinate on a sphere per slip velocity, for a given |s|^2."""
    return 1.0 + 0.25 * squared / (radius * radius)


@compiled
def bend_bias(
    kind: int,
    radius: float,
    slips: tuple[float, float],
    speeds: tuple[float, float],
    frame: Floats,
    bias: Floats,
) -> None:
    """Adds the acceleration due to the curvature of the face to the bias of a tip.

    It is |s'|^2 / R of the curved directions, towards the centre; on a sphere, t_x and t_y also
    turn about the normal.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        slips: Coordinates of the contact [m].
        speeds: Slip velocities along its tangents [m/s].
        frame: t_x, t_y and n at the contact, ``(3, 3)``.
        bias: Bias of the tip acceleration, ``(3,)`` [m/s^2].
    """
    first, second = speeds
    inwards, turn = second * second / radius, 0.0
    if kind == SPHERE:
        inwards += first * first / radius
        turn = 0.5 * (slips[1] * first - slips[0] * second) / (radius * radius)
    for c in range(3):
        bias[c] += inwards * frame[2, c]
        bias[c] += turn * (first * frame[1, c] - second * frame[0, c])


@compiled
def normal_rate(
    kind: int, radius: float, speeds: tuple[float, float], frame: Floats
) -> tuple[float, float, float]:
    """Time derivative of the contact normal due to slip on a curved face [1/s].

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        speeds: Slip velocities along its tangents [m/s].
        frame: t_x, t_y and n at the contact, ``(3, 3)``.
    """
    first = -speeds[0] / radius if kind == SPHERE else 0.0
    second = -speeds[1] / radius
    return (
        first * frame[0, 0] + second * frame[1, 0],
        first * frame[0, 1] + second * frame[1, 1],
        first * frame[0, 2] + second * frame[1, 2],
    )


@compiled
def start_on_face(
    kind: int, radius: float, first: float, second: float, frame: Floats, anchor: Floats
) -> None:
    """Moves an anchor and its frame along an arc of a curved face.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        first: Arc length along t_x [m].
        second: Arc length along t_y [m].
        frame: t_x, t_y and n at the anchor, ``(3, 3)``; updated.
        anchor: Anchor, ``(3,)`` [m]; updated.
    """
    scale = 1.0
    if kind == SPHERE:
        half = 0.5 * np.sqrt(first * first + second * second) / radius
        if half > 0.0:
            sine, cosine = sincos(half)
            scale = sine / (cosine * half)
    first, second = scale * first, scale * second
    for c in range(3):
        anchor[c] += first * frame[0, c] + second * frame[1, c]
    follow_face(kind, radius, first, second, frame, anchor)
