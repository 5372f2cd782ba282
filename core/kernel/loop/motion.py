"""Desired motion of the object: that of the paper, or general segments.

With s the time since the start of a segment, coordinate c of a general segment is

    polynomials[c] · (1, s, … s^5) + sine[c] sin(psi) + cosine[c] (1 - cos(psi)),

psi = angles · (1, s, s^2). The last segment is an unlimited rest.
`slipgrasp.core.kernel.loop.pieces` creates the segments.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Layout, Record
from slipgrasp.core.kernel.numerics.elementary import sincos
from slipgrasp.core.scenario import MAX_SET_POINTS, MAX_TABLE_ROWS
from slipgrasp.core.scenario.motion import SAME_TIME

DEGREE = 5
MAX_PIECES = max(MAX_TABLE_ROWS, 2 * MAX_SET_POINTS + 1)


def motion_layout(num_coordinates: int) -> Layout:
    """Layout of the desired motion of some coordinates, in metres and radians."""
    each = (num_coordinates,)
    fields = [
        ("coasts", np.bool_),  # true for the paper's motion, given by start and acceleration
        ("start", np.float64, each),
        ("acceleration", np.float64, each),
        ("breaks", np.float64, (MAX_PIECES,)),  # ends of segments; inf for the last [s]
        ("sine", np.float64, each),
        ("cosine", np.float64, each),
        ("angles", np.float64, (MAX_PIECES, 3)),  # [rad, and per power of s]
        ("polynomials", np.float64, (MAX_PIECES, num_coordinates, DEGREE + 1)),  # per power of s
    ]
    return np.dtype(fields, align=True)


@compiled
def pass_breaks(motion: Record, discrete: Record, t: float) -> None:
    """Advances the current segment of the desired motion to time ``t``.

    Breaks after ``t`` within rounding count as passed, because times of ticks and breaks are sums.
    """
    while motion.breaks[discrete.piece] <= t + SAME_TIME:
        discrete.piece += 1


@compiled
def desired_motion(
    motion: Record, piece: int, t: float, coordinate: int
) -> tuple[float, float, float]:
    """Desired position, velocity and acceleration of a coordinate on a segment of the motion.

    The segment is an argument instead of a function of ``t``, so that values at a break are
    one-sided.
    """
    if motion.coasts:
        return _coast(motion, piece, t, coordinate)
    s = t - motion.breaks[piece - 1] if piece > 0 else t
    return _on_piece(motion, piece, s, coordinate)


@compiled
def _coast(motion: Record, piece: int, t: float, coordinate: int) -> tuple[float, float, float]:
    """Eq. 64: three segments of constant acceleration, then rest."""
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


@compiled
def _on_piece(motion: Record, piece: int, s: float, coordinate: int) -> tuple[float, float, float]:
    """Evaluates the polynomial by Horner's rule, and adds the oscillation with the angle psi."""
    position, velocity, bend = 0.0, 0.0, 0.0
    for k in range(DEGREE, -1, -1):
        bend = bend * s + velocity
        velocity = velocity * s + position
        position = position * s + motion.polynomials[piece, coordinate, k]
    acceleration = 2.0 * bend
    a, b = motion.sine[coordinate], motion.cosine[coordinate]
    if a != 0.0 or b != 0.0:
        curve = motion.angles[piece, 2]
        rate = motion.angles[piece, 1] + 2.0 * curve * s
        psi = motion.angles[piece, 0] + s * (motion.angles[piece, 1] + s * curve)
        sine, cosine = sincos(psi)
        along, across = a * cosine + b * sine, b * cosine - a * sine
        position += a * sine + b * (1.0 - cosine)
        velocity += rate * along
        acceleration += 2.0 * curve * along + rate * rate * across
    return position, velocity, acceleration
