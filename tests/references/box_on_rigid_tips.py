"""A box held off its centre of mass by two soft, rigid tips: a planar body in closed equations.

Independent of hands and controllers: the limit of fingers whose tips are held ever more stiffly.
Both tips do the same by symmetry, so that the box moves in the plane of its faces under its weight
and twice the wrench of one tip, which opposes the slip on the limit surface with
``|(F, moment / e)| = mu F_n``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Floats = NDArray[np.float64]

GRAVITY = 9.81  # [m/s^2]


class RigidTips(NamedTuple):
    """The grasp.

    Attributes:
        mass: Of the box [kg].
        inertia: About the normal of the faces [kg m^2].
        offset: Of the tips from the centre of mass, sideways [m].
        limit: Largest friction force of a tip [N].
        eccentricity: Largest moment of a tip over its largest force [m].
    """

    mass: float = 1.0
    inertia: float = 0.0108
    offset: float = 0.02
    limit: float = 10.0
    eccentricity: float = 0.01

    def accelerations(self, state: Floats, direction: Floats) -> Floats:
        """Of the box (sideways, up, turn) if the tips' wrenches oppose a unit direction of slip."""
        force = -2.0 * self.limit * direction[:2]
        moment = -2.0 * self.eccentricity * self.limit * direction[2]
        arm = np.array([self.offset - state[0], -state[1]])
        about = arm[0] * force[1] - arm[1] * force[0]
        linear = force / self.mass - [0.0, GRAVITY]
        return np.array([*linear, (moment + about) / self.inertia])

    def slip(self, state: Floats, motion: Floats) -> Floats:
        """Velocity (or acceleration from rest) of the box at a tip, with the turn times e [m/s]."""
        arm = self.offset - state[0], -state[1]
        sideways, up, turn = motion
        return np.array([sideways - turn * arm[1], up + turn * arm[0], self.eccentricity * turn])

    def onset(self) -> Floats:
        """Direction in which the box starts to slip: that of its own acceleration."""
        rest = np.zeros(6)

        def direction(angle: float) -> Floats:
            return np.array([0.0, -np.cos(angle), np.sin(angle)])

        def mismatch(angle: float) -> float:
            way = direction(angle)
            away = self.slip(rest, self.accelerations(rest, way))
            return float(away[1] * way[2] - away[2] * way[1])

        # Down at the tips, and towards the side of the centre of mass.
        return direction(brentq(mismatch, 0.0, 0.5 * np.pi, xtol=1e-15))

    def turn(self, times: Sequence[float] = (0.0,)) -> Turned:
        """Motion from rest until the box stops.

        Args:
            times: Where its angle is wanted [s].
        """
        first, start = self.onset(), np.zeros(7)
        early = 1e-7  # [s]; until then the direction is that of the onset
        start[3:6] = early * self.accelerations(start[:6], first)

        def rates(_: float, y: Floats) -> Floats:
            slip = self.slip(y[:6], y[3:6])
            speed = float(np.linalg.norm(slip))
            moves = self.accelerations(y[:6], slip / max(speed, 1e-300))
            return np.array([*y[3:6], *moves, np.hypot(slip[0], slip[1])])

        def stops(_: float, y: Floats) -> float:
            return float(np.linalg.norm(self.slip(y[:6], y[3:6]))) - 1e-7

        stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
        options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "dense_output": True}
        found = solve_ivp(rates, (early, 10.0), start, events=stops, **options)
        last = found.y[:, -1]
        angles = np.abs(found.sol(np.minimum(times, found.t[-1]))[2])
        return Turned(float(abs(last[2])), float(found.t[-1]), float(last[6]), angles)


class Turned(NamedTuple):
    """How the box turned.

    Attributes:
        angle: At the stop [rad].
        time: Of the stop [s].
        path: Of a tip on its face [m].
        angles: At the times asked for [rad].
    """

    angle: float
    time: float
    path: float
    angles: Floats
