"""Desired motions other than the paper's as smooth pieces (docs/model.md, Desired motion)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import MAX_SET_POINTS, MAX_TABLE_ROWS, TrajectoryParameters

DEGREE = 5
MAX_PIECES = max(MAX_TABLE_ROWS, 2 * MAX_SET_POINTS + 1)

# Times closer than this are one time: 0.1 + 0.2 and 0.3 [s].
SAME_TIME = 1e-12

_MINIMUM_JERK = (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)


class Pieces(NamedTuple):
    """A desired motion; the last of its k pieces is a rest and never ends.

    With s the time since its piece began, a coordinate c is

        polynomials[c] · (1, s, … s^5) + sine[c] sin(psi) + cosine[c] (1 - cos(psi)),

    psi = angles · (1, s, s^2).

    Attributes:
        starts: When the pieces begin, ``(k,)`` [s].
        polynomials: ``(k, 3, 6)`` [m, m, rad, and per power of s].
        angles: ``(k, 3)`` [rad, and per power of s].
        sine: ``(3,)`` [m, m, rad].
        cosine: ``(3,)`` [m, m, rad].
    """

    starts: NDArray[np.float64]
    polynomials: NDArray[np.float64]
    angles: NDArray[np.float64]
    sine: NDArray[np.float64]
    cosine: NDArray[np.float64]


@lru_cache(maxsize=32)
def pieces_of(trajectory: TrajectoryParameters) -> Pieces:
    """The pieces of any validated motion but the paper's, which the kernel has in closed form."""
    if trajectory.kind == "set-points":
        return _moves(trajectory)
    if trajectory.kind == "table":
        return _spline(trajectory)
    return _cycles(trajectory)


def _moves(trajectory: TrajectoryParameters) -> Pieces:
    """From set-point to set-point with the least jerk, at rest in between."""
    starts: list[float] = []
    polynomials: list[NDArray[np.float64]] = []
    pose, now = np.array(trajectory.start), 0.0
    for point in trajectory.set_points:
        if point.time - now > SAME_TIME:
            starts.append(now)
            polynomials.append(_rest(pose))
        goal = np.array(point.pose)
        shape = np.array(_MINIMUM_JERK) / point.duration ** np.arange(DEGREE + 1)
        starts.append(point.time)
        polynomials.append(_rest(pose) + np.outer(goal - pose, shape))
        pose, now = goal, point.time + point.duration
    return _polynomial_pieces(np.array([*starts, now]), np.stack([*polynomials, _rest(pose)]))


def _spline(trajectory: TrajectoryParameters) -> Pieces:
    """The cubic spline through the rows of the table, at rest at both ends."""
    rows = np.array(trajectory.table)
    times, poses = rows[:, 0], rows[:, 1:]
    poses[0] = trajectory.start
    steps = np.diff(times)[:, None]
    secants = np.diff(poses, axis=0) / steps
    speeds = _spline_speeds(steps[:, 0], secants)
    before, after = speeds[:-1], speeds[1:]
    polynomials = np.zeros((len(rows), 3, DEGREE + 1))
    polynomials[:, :, 0] = poses
    polynomials[:-1, :, 1] = before
    polynomials[:-1, :, 2] = (3.0 * secants - 2.0 * before - after) / steps
    polynomials[:-1, :, 3] = (before + after - 2.0 * secants) / steps**2
    return _polynomial_pieces(times, polynomials)


def _spline_speeds(steps: NDArray[np.float64], secants: NDArray[np.float64]) -> NDArray[np.float64]:
    """Velocities at the rows, ``(rows, 3)``, with which the acceleration does not jump."""
    inverse = 1.0 / steps
    inner = np.diag(2.0 * (inverse[:-1] + inverse[1:]))
    inner += np.diag(inverse[1:-1], 1) + np.diag(inverse[1:-1], -1)
    weighted = 3.0 * secants * inverse[:, None]
    speeds = np.zeros((len(steps) + 1, 3))
    if len(steps) > 1:
        speeds[1:-1] = np.linalg.solve(inner, weighted[:-1] + weighted[1:])
    return speeds


def _cycles(trajectory: TrajectoryParameters) -> Pieces:
    """Circle, rotation and shake: psi speeds up from rest, runs evenly and brakes alike."""
    speed, ramp = 2.0 * math.pi / trajectory.period, trajectory.acceleration_time
    even = trajectory.cycles * trajectory.period - ramp
    even = even if even > SAME_TIME else 0.0
    curve, swept = 0.5 * speed / ramp, 0.5 * speed * ramp
    angles = np.array(
        [
            (0.0, 0.0, curve),
            (swept, speed, 0.0),
            (swept + speed * even, speed, -curve),
            (2.0 * math.pi * trajectory.cycles, 0.0, 0.0),
        ]
    )
    sine, cosine = np.zeros(3), np.zeros(3)
    if trajectory.kind == "circle":
        sine[0] = cosine[1] = trajectory.radius
    elif trajectory.kind == "rotation":
        cosine[2] = 0.5 * trajectory.angle
    else:
        sine[:] = trajectory.amplitude
    starts = np.array([0.0, ramp, ramp + even, ramp + even + ramp])
    middle = np.broadcast_to(_rest(np.array(trajectory.start)), (4, 3, DEGREE + 1))
    return Pieces(starts, middle, angles, sine, cosine)


def _rest(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """The constant polynomials, ``(3, 6)``."""
    return np.outer(pose, np.eye(1, DEGREE + 1))


def _polynomial_pieces(starts: NDArray[np.float64], polynomials: NDArray[np.float64]) -> Pieces:
    """Pieces without any oscillation."""
    return Pieces(starts, polynomials, np.zeros((len(starts), 3)), np.zeros(3), np.zeros(3))
