"""Contacts on the side of a cylinder and on a sphere (docs/space.md, Round objects).

R is the radius, all vectors are in the axes of the frame that is given. A cylinder is curved along
its second tangent, along which slip is the arc. Slip on a sphere is in stereographic coordinates,
s = 2 R tan(angle / 2) along the direction from the anchor: they have no pole but opposite of it,
and their directions are tangents of one length, t_x and t_y, so that only slip velocities along
these occur in the equations, and s' = (1 + |s|^2 / 4 R^2) times them.
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
    """Bends a contact that has slipped straight on its tangent plane to a curved face.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        first: Slip along t_x [m].
        second: Slip along t_y [m].
        frame: t_x, t_y and n at the anchor, ``(3, 3)``; afterwards those at the contact.
        point: The contact as if the face were flat, ``(3,)``; afterwards the contact [m].
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
    """Rate of a coordinate of a sphere per slip velocity, at |s|^2."""
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
    """Adds to the bias of a tip what turns its way along a curved face.

    Towards the centre |s'|^2 / R of the curved directions; on a sphere t_x and t_y turn about the
    normal too.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        slips: Coordinates of the contact [m].
        speeds: Slip velocities along its tangents [m/s].
        frame: t_x, t_y and n there, ``(3, 3)``.
        bias: Of the acceleration of the tip, ``(3,)`` [m/s^2].
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
    """How the normal of a contact turns as its tip slips on a curved face [1/s].

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        speeds: Slip velocities along its tangents [m/s].
        frame: t_x, t_y and n there, ``(3, 3)``.
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
    """Moves an anchor along an arc of a curved face, and its frame with it.

    Args:
        kind: `CYLINDER` or `SPHERE`.
        radius: R [m].
        first: The arc along t_x [m].
        second: The arc along t_y [m].
        frame: t_x, t_y and n at the anchor, ``(3, 3)``.
        anchor: What is moved, ``(3,)`` [m].
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
