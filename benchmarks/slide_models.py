"""Models of a body that slides and spins on a plane, in closed form up to one quadrature.

With speed u, spin w and s = sqrt(u² + c² w²) an ellipsoid limit surface of radius c gives

    u' = -mu g u / s,    w' = -mu g (c/k)² w / s,

where k is the radius of gyration; the direction of the velocity does not change. Along l with
dt = s dl / (mu g) this is u = u0 exp(-l), w = w0 exp(-(c/k)² l), so that time, path and angle are
integrals over l of s, u s and w s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from benchmarks.real_slides import HALF_WIDTH, Floats

GRAVITY = 9.81
GYRATION = HALF_WIDTH * np.sqrt(2.0 / 3.0)
"""Radius of gyration of a homogeneous cube about its axis [m]."""

UNIFORM_RADIUS = 0.3826 * 2.0 * HALF_WIDTH
"""Radius c of a uniform pressure over the face [m]: the mean distance from its centre."""

_STEPS = 400
_DECAY = 14.0
"""Value of l at which speed and spin are e^-14 of their initial values."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A slide from its start to rest.

    Attributes:
        times: Increasing times [s].
        path: Distance along the direction of the velocity [m].
        angle: Angle of rotation [rad].
    """

    times: Floats
    path: Floats
    angle: Floats

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Distance and angle at given times; constant after the end."""
        return np.interp(times, self.times, self.path), np.interp(times, self.times, self.angle)


Model = Callable[[float, float, float, float], Motion]
"""The motion from initial speed [m/s] and spin [rad/s], friction and radius c [m]."""


def slide_on_ellipsoid(speed: float, spin: float, friction: float, radius: float) -> Motion:
    """The motion with an ellipsoid limit surface, which couples friction and torsion."""
    ratio = (radius / GYRATION) ** 2
    # Denser at the start; the slower decay determines the end.
    l = np.linspace(0.0, 1.0, _STEPS) ** 1.5 * _DECAY
    if ratio < 1.0:
        l = np.concatenate([l, np.geomspace(_DECAY, _DECAY / ratio, _STEPS // 2)[1:]])
    u, w = speed * np.exp(-l), spin * np.exp(-ratio * l)
    s = np.hypot(u, radius * w)
    integrals = cumulative_trapezoid([s, u * s, w * s], l, initial=0.0)
    return Motion(*(integrals / (friction * GRAVITY)))


def slide_without_coupling(speed: float, spin: float, friction: float, radius: float) -> Motion:
    """The motion with friction alone: u' = -mu g, and a constant spin until the slide ends."""
    return _parabolas(speed, spin, friction * GRAVITY, 0.0)


def slide_independently(speed: float, spin: float, friction: float, radius: float) -> Motion:
    """The motion with torsion independent of the slip: w' = -mu g c / k²."""
    return _parabolas(speed, spin, friction * GRAVITY, friction * GRAVITY * radius / GYRATION**2)


MODELS: dict[str, Model] = {
    "no spin coupling": slide_without_coupling,
    "independent torsion": slide_independently,
    "ellipsoid": slide_on_ellipsoid,
}


def stop_distance(model: Model, speed: float, spin: float, friction: float, radius: float) -> float:
    """The distance until rest [m]."""
    return float(model(speed, spin, friction, radius).path[-1])


def _parabolas(speed: float, spin: float, slowing: float, torsion: float) -> Motion:
    """Speed and spin that decrease linearly to zero."""
    stop = speed / slowing
    rest = abs(spin) / torsion if torsion > 0.0 else stop
    times = np.linspace(0.0, max(stop, rest), _STEPS)
    sliding, turning = np.minimum(times, stop), np.minimum(times, rest)
    path = speed * sliding - 0.5 * slowing * sliding**2
    angle = spin * turning - 0.5 * np.sign(spin) * torsion * turning**2
    return Motion(times, path, angle)
