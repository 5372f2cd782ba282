"""The desired motion, from piecewise polynomials of scipy and the chain rule."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BPoly, CubicSpline, PPoly

from slipgrasp.core.scenario import TrajectoryParameters

Array = NDArray[np.float64]

# Pose and its first two derivatives with respect to an angle, as functions of that angle.
Path = Callable[[float], tuple[Array, Array, Array]]

FOREVER = 1e6  # until when the last rest is written down [s]


class Trajectory(Protocol):
    """A desired motion, smooth between the break points."""

    @property
    def start(self) -> Array:
        """Pose at t = 0."""
        ...

    @property
    def breaks(self) -> Array:
        """Times at which one piece ends and the next begins."""
        ...

    def desired(self, t: float, piece_time: float | None = None) -> tuple[Array, Array, Array]:
        """Desired pose, velocity and acceleration.

        Args:
            t: Time [s].
            piece_time: A time inside the piece that holds; ``t`` by default.
        """
        ...


class Coast(NamedTuple):
    """Accelerate, coast, brake, rest (Eq. 64); quadratic between the break points."""

    start: Array
    acceleration: Array
    breaks: Array  # times at which the acceleration jumps

    def desired(self, t: float, piece_time: float | None = None) -> tuple[Array, Array, Array]:
        """Desired pose, velocity and acceleration.

        Args:
            t: Time [s].
            piece_time: A time inside the piece whose acceleration holds; ``t`` by default.
        """
        when = t if piece_time is None else piece_time
        signs = np.array([1.0, 0.0, -1.0, 0.0])
        piece = int(np.searchsorted(self.breaks, when + 1e-9))
        starts = np.concatenate(([0.0], self.breaks))
        position, speed = 0.0, 0.0
        for k in range(piece):
            dt = starts[k + 1] - starts[k]
            position += speed * dt + 0.5 * signs[k] * dt**2
            speed += signs[k] * dt
        dt = t - starts[piece]
        position += speed * dt + 0.5 * signs[piece] * dt**2
        speed += signs[piece] * dt
        a = self.acceleration
        return self.start + a * position, a * speed, a * signs[piece]


class Curve(NamedTuple):
    """A curve of scipy: either the pose over time, or an angle on which the pose depends."""

    curve: PPoly
    path: Path | None = None

    @property
    def start(self) -> Array:
        return self.desired(0.0)[0]

    @property
    def breaks(self) -> Array:
        return self.curve.x[1:-1]

    def desired(self, t: float, piece_time: float | None = None) -> tuple[Array, Array, Array]:
        when = t + 1e-9 if piece_time is None else piece_time
        k = int(np.searchsorted(self.breaks, when))
        piece = PPoly(self.curve.c[:, k : k + 1], self.curve.x[k : k + 2])
        value, rate, bend = (piece(t, order) for order in range(3))
        if self.path is None:
            return value, rate, bend
        pose, slope, curvature = self.path(float(value))
        return pose, slope * rate, curvature * rate**2 + slope * bend


def trajectory_of(parameters: TrajectoryParameters) -> Trajectory:
    """The desired motion of a scenario."""
    start = np.array(parameters.start)
    if parameters.kind == "coast":
        ramp = parameters.acceleration_time
        breaks = np.cumsum([ramp, parameters.coast_time, ramp])
        return Coast(start, np.array(parameters.acceleration), breaks)
    if parameters.kind == "set-points":
        return Curve(_hermite(parameters))
    if parameters.kind == "table":
        return Curve(_then_rest(_spline(parameters)))
    return Curve(_angle(parameters), _path(parameters))


def _hermite(parameters: TrajectoryParameters) -> PPoly:
    """Quintics between rests: the least jerk follows from pose, speed and acceleration."""
    times, poses = [0.0], [np.array(parameters.start)]
    for point in parameters.set_points:
        for time, pose in (
            (point.time, poses[-1]),
            (point.time + point.duration, np.array(point.pose)),
        ):
            if time > times[-1] + 1e-12:
                times.append(time)
                poses.append(pose)
    times.append(FOREVER)
    poses.append(poses[-1])
    rests = [[pose, np.zeros(3), np.zeros(3)] for pose in poses]
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(times, rests))


def _spline(parameters: TrajectoryParameters) -> PPoly:
    rows = np.array(parameters.table)
    return CubicSpline(rows[:, 0], rows[:, 1:], bc_type="clamped")


def _then_rest(curve: PPoly) -> PPoly:
    rest = np.zeros((len(curve.c), 1, 3))
    rest[-1, 0] = curve(curve.x[-1])
    return PPoly(np.concatenate((curve.c, rest), axis=1), np.append(curve.x, FOREVER))


def _angle(parameters: TrajectoryParameters) -> PPoly:
    """The integral of a speed that rises, stays and falls, scaled to all its cycles."""
    ramp = parameters.acceleration_time
    end = parameters.cycles * parameters.period + ramp
    times = np.array([0.0, ramp, end - ramp, end, FOREVER])
    speed = 2.0 * np.pi / parameters.period
    shape = np.array([[speed / ramp, 0.0, -speed / ramp, 0.0], [0.0, speed, speed, 0.0]])
    angle: PPoly = PPoly(shape, times).antiderivative()
    return angle


def _path(parameters: TrajectoryParameters) -> Path:
    """How the pose depends on the angle."""
    start = np.array(parameters.start)
    if parameters.kind == "shake":
        amplitude = np.array(parameters.amplitude)
        return lambda psi: (
            start + amplitude * np.sin(psi),
            amplitude * np.cos(psi),
            -amplitude * np.sin(psi),
        )
    if parameters.kind == "rotation":
        turn = np.array([0.0, 0.0, parameters.angle])
        return lambda psi: (
            start + turn * np.sin(0.5 * psi) ** 2,
            0.5 * turn * np.sin(psi),
            0.5 * turn * np.cos(psi),
        )

    def circle(psi: float) -> tuple[Array, Array, Array]:
        arm = parameters.radius * np.exp(1j * (psi - 0.5 * np.pi))
        middle = start + np.array([0.0, parameters.radius, 0.0])
        return middle + _in_plane(arm), _in_plane(1j * arm), _in_plane(-arm)

    return circle


def _in_plane(z: complex) -> Array:
    return np.array([z.real, z.imag, 0.0])
