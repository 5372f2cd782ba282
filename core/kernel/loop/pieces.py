"""Segments of a desired motion, from its parameters (docs/model.md, Desired motion)."""

from __future__ import annotations

import math

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.motion import DEGREE, MAX_PIECES
from slipgrasp.core.scenario import TrajectoryParameters
from slipgrasp.core.scenario.motion import SAME_TIME
from slipgrasp.core.scenario.table import choices_of

_KINDS = choices_of(TrajectoryParameters, "kind")
COAST, SET_POINTS, CIRCLE, ROTATION, TABLE = (
    _KINDS.index(kind) for kind in ("coast", "set-points", "circle", "rotation", "table")
)

# Minimum-jerk motion from 0 to 1 in unit time: coefficients of powers 3 to 5.
_MINIMUM_JERK = (10.0, -15.0, 6.0)


@compiled
def pack_motion(path: Record, motion: Record) -> None:
    """Writes the desired motion.

    Args:
        path: Trajectory in the table of a scenario.
        motion: Output; every field in use is set.
    """
    for c in range(3):
        motion.start[c] = path.start[c]
        motion.acceleration[c] = path.acceleration[c]
        motion.sine[c] = motion.cosine[c] = 0.0
    for piece in range(MAX_PIECES):
        motion.breaks[piece] = np.inf
    motion.coasts = path.kind == COAST
    if path.kind == COAST:
        first = path.acceleration_time
        second = first + path.coast_time
        motion.breaks[0], motion.breaks[1] = first, second
        motion.breaks[2] = second + path.acceleration_time
    elif path.kind == SET_POINTS:
        _pack_moves(path, motion)
    elif path.kind == TABLE:
        _pack_spline(path, motion)
    else:
        _pack_cycles(path, motion)


@compiled
def _begin_piece(motion: Record, piece: int, start: float) -> None:
    """Starts a segment at rest at zero, and ends the previous one."""
    if piece > 0:
        motion.breaks[piece - 1] = start
    for c in range(3):
        motion.angles[piece, c] = 0.0
        for k in range(DEGREE + 1):
            motion.polynomials[piece, c, k] = 0.0


@compiled
def _pack_moves(path: Record, motion: Record) -> None:
    """Packs minimum-jerk motions between set-points, with rests in between."""
    piece, now, points = 0, 0.0, path.set_points
    begin = path.start
    for i in range(int(points.count)):
        point = points.entries[i]
        if point.time - now > SAME_TIME:
            _rest(motion, piece, now, begin)
            piece += 1
        _rest(motion, piece, point.time, begin)
        power = point.duration * point.duration
        for k in range(3):
            power *= point.duration
            for c in range(3):
                way = point.pose[c] - begin[c]
                motion.polynomials[piece, c, 3 + k] = way * (_MINIMUM_JERK[k] / power)
        piece += 1
        begin, now = point.pose, point.time + point.duration
    _rest(motion, piece, now, begin)


@compiled
def _rest(motion: Record, piece: int, start: float, pose: np.ndarray) -> None:
    """Starts a segment at rest at a pose."""
    _begin_piece(motion, piece, start)
    for c in range(3):
        motion.polynomials[piece, c, 0] = pose[c]


@compiled
def _pack_spline(path: Record, motion: Record) -> None:
    """Packs the cubic spline through the rows of the table, at rest at both ends."""
    rows, last = path.table.entries, int(path.table.count) - 1
    for k in range(last + 1):
        _begin_piece(motion, k, rows[k, 0])
        for c in range(3):
            motion.polynomials[k, c, 0] = rows[k, 1 + c] if k > 0 else path.start[c]
    for c in range(3):
        _find_speeds(motion, rows, c, last)
        for k in range(last):
            step = rows[k + 1, 0] - rows[k, 0]
            here, there = motion.polynomials[k, c], motion.polynomials[k + 1, c]
            secant = (there[0] - here[0]) / step
            here[2] = (3.0 * secant - 2.0 * here[1] - there[1]) / step
            here[3] = (here[1] + there[1] - 2.0 * secant) / (step * step)


@compiled
def _find_speeds(motion: Record, rows: np.ndarray, c: int, last: int) -> None:
    """Computes the velocities at the rows for continuous acceleration, as coefficients 1.

    The equations are tridiagonal and diagonally dominant, solved by the Thomas algorithm. The
    factors of back substitution are stored temporarily as coefficients 2.
    """
    for k in range(1, last):
        before, here = motion.polynomials[k - 1, c], motion.polynomials[k, c]
        after = motion.polynomials[k + 1, c]
        step, next_step = rows[k, 0] - rows[k - 1, 0], rows[k + 1, 0] - rows[k, 0]
        inverse, next_inverse = 1.0 / step, 1.0 / next_step
        secant, next_secant = (here[0] - before[0]) / step, (after[0] - here[0]) / next_step
        pivot = 2.0 * (inverse + next_inverse) - inverse * before[2]
        right = 3.0 * secant * inverse + 3.0 * next_secant * next_inverse
        here[1] = (right - inverse * before[1]) / pivot
        here[2] = next_inverse / pivot
    for k in range(last - 1, 0, -1):
        here, after = motion.polynomials[k, c], motion.polynomials[k + 1, c]
        here[1] -= here[2] * after[1]
    for k in range(last):
        motion.polynomials[k, c, 2] = 0.0


@compiled
def _pack_cycles(path: Record, motion: Record) -> None:
    """Packs circle, rotation or shake: psi accelerates from rest, is uniform, then decelerates."""
    speed, ramp = 2.0 * math.pi / path.period, path.acceleration_time
    even = path.cycles * path.period - ramp
    if even <= SAME_TIME:
        even = 0.0
    curve, swept = 0.5 * speed / ramp, 0.5 * speed * ramp
    _rest(motion, 0, 0.0, path.start)
    _rest(motion, 1, ramp, path.start)
    _rest(motion, 2, ramp + even, path.start)
    _rest(motion, 3, ramp + even + ramp, path.start)
    angles = motion.angles
    angles[0, 2] = curve
    angles[1, 0], angles[1, 1] = swept, speed
    angles[2, 0], angles[2, 1], angles[2, 2] = swept + speed * even, speed, -curve
    angles[3, 0] = 2.0 * math.pi * path.cycles
    if path.kind == CIRCLE:
        motion.sine[0] = motion.cosine[1] = path.radius
    elif path.kind == ROTATION:
        motion.cosine[2] = 0.5 * path.angle
    else:
        for c in range(3):
            motion.sine[c] = path.amplitude[c]
