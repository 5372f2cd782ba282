"""Desired motion of spatial objects: six coordinates as in `slipgrasp.core.kernel.loop.motion`.

The last three are the rotation vector r of the object relative to its initial attitude,
R_des = exp(r) R_start; angular velocity and acceleration are A(r) r' and A(r) r'' + A' r'.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.motion import motion_layout
from slipgrasp.core.scenario.motion import SAME_TIME
from slipgrasp.core.scenario.spatial import SpatialTrajectory

_MINIMUM_JERK = (10.0, -15.0, 6.0)

MOTION = motion_layout(6)


def pack_motion(path: SpatialTrajectory, motion: Record) -> None:
    """Writes the desired motion to an all-zero record."""
    motion.start[:3] = path.start[:3]
    motion.breaks[:] = np.inf
    motion.coasts = path.kind == "coast"
    if path.kind == "coast":
        motion.acceleration[:] = path.acceleration
        first = path.acceleration_time
        second = first + path.coast_time
        motion.breaks[:3] = first, second, second + path.acceleration_time
    elif path.kind == "set-points":
        _pack_moves(path, motion)
    elif path.kind == "table":
        _pack_spline(path, motion)
    else:
        _pack_cycles(path, motion)


def _rest(motion: Record, piece: int, start: float, pose: tuple[float, ...]) -> None:
    """Starts a segment at rest at a pose, and ends the previous one."""
    if piece > 0:
        motion.breaks[piece - 1] = start
    motion.polynomials[piece, :, 0] = pose


def _pack_moves(path: SpatialTrajectory, motion: Record) -> None:
    """Packs minimum-jerk motions between set-points, with rests in between."""
    piece, now, pose = 0, 0.0, tuple(motion.start.tolist())
    for point in path.set_points:
        if point.time - now > SAME_TIME:
            _rest(motion, piece, now, pose)
            piece += 1
        _rest(motion, piece, point.time, pose)
        power = point.duration * point.duration
        for k in range(3):
            power *= point.duration
            for c in range(6):
                way = point.pose[c] - pose[c]
                motion.polynomials[piece, c, 3 + k] = way * (_MINIMUM_JERK[k] / power)
        piece += 1
        pose, now = point.pose, point.time + point.duration
    _rest(motion, piece, now, pose)


def _pack_spline(path: SpatialTrajectory, motion: Record) -> None:
    """Packs the cubic spline through the rows of the table, at rest at both ends."""
    last, times = len(path.table) - 1, [row[0] for row in path.table]
    _rest(motion, 0, 0.0, tuple(motion.start.tolist()))
    for k, row in enumerate(path.table[1:], 1):
        _rest(motion, k, row[0], row[1:])
    steps = [after - before for before, after in pairwise(times)]
    poses = motion.polynomials[: last + 1, :, 0]
    secants = [(poses[k + 1] - poses[k]) / step for k, step in enumerate(steps)]
    speeds = _speeds(steps, secants)
    for k, (step, secant) in enumerate(zip(steps, secants, strict=True)):
        here, there = speeds[k], speeds[k + 1]
        motion.polynomials[k, :, 1] = here
        motion.polynomials[k, :, 2] = (3.0 * secant - 2.0 * here - there) / step
        motion.polynomials[k, :, 3] = (here + there - 2.0 * secant) / (step * step)


def _speeds(steps: Sequence[float], secants: Sequence[Floats]) -> list[Floats]:
    """Velocities at the rows for continuous acceleration, zero at both ends.

    The equations are tridiagonal and diagonally dominant, solved by the Thomas algorithm.
    """
    ratios, rights = [0.0], [np.zeros(6)]
    for k in range(1, len(steps)):
        inverse, next_inverse = 1.0 / steps[k - 1], 1.0 / steps[k]
        pivot = 2.0 * (inverse + next_inverse) - inverse * ratios[-1]
        right = 3.0 * (inverse * secants[k - 1] + next_inverse * secants[k])
        rights.append((right - inverse * rights[-1]) / pivot)
        ratios.append(next_inverse / pivot)
    speeds = [np.zeros(6)]
    for ratio, right in zip(ratios[:0:-1], rights[:0:-1], strict=True):
        speeds.append(right - ratio * speeds[-1])
    return [*([np.zeros(6)] if steps else []), *speeds[::-1]]


def _pack_cycles(path: SpatialTrajectory, motion: Record) -> None:
    """Packs circle, rotation or shake: psi accelerates from rest, is uniform, then decelerates."""
    speed, ramp = 2.0 * math.pi / path.period, path.acceleration_time
    even = max(path.cycles * path.period - ramp, 0.0)
    curve, swept = 0.5 * speed / ramp, 0.5 * speed * ramp
    pose = tuple(motion.start.tolist())
    for piece, start in enumerate((0.0, ramp, ramp + even, ramp + even + ramp)):
        _rest(motion, piece, start, pose)
    angles = motion.angles
    angles[0, 2] = curve
    angles[1, :2] = swept, speed
    angles[2] = swept + speed * even, speed, -curve
    angles[3, 0] = 2.0 * math.pi * path.cycles
    if path.kind == "circle":
        motion.sine[0] = motion.cosine[2] = path.radius
    elif path.kind == "rotation":
        motion.cosine[3:] = [0.5 * angle for angle in path.angle]
    else:
        motion.sine[:] = path.amplitude
