"""A planar finger of two links, from the motion of each link's centre of mass.

The dynamics are d'Alembert's principle written out: forces are projected onto the
Jacobian of each centre of mass, so no Lagrangian formula is copied.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Squared angular velocity of a link per products of joint rates.
_SPIN = (np.array([[1.0, 0.0], [0.0, 0.0]]), np.ones((2, 2)))


def _direction(angle: float) -> Array:
    return np.array([cos(angle), sin(angle)])


class Finger(NamedTuple):
    """Geometry of a finger; its link masses are given to each function that needs them.

    Attributes:
        base: Position of the first joint [m].
        lengths: Link lengths [m].
        centres: Distance of each link's centre of mass from its joint [m].
        inertias: Moment of inertia about the centre of mass per mass [m^2].
        elbow: Sign of the second joint angle.
    """

    base: Array
    lengths: Array
    centres: Array
    inertias: Array
    elbow: float

    def joint_positions(self, tip: Array) -> Array:
        """Inverse kinematics on the finger's elbow branch [rad]."""
        l1, l2 = self.lengths
        reach = tip - self.base
        cosine = (reach @ reach - l1**2 - l2**2) / (2.0 * l1 * l2)
        q2 = self.elbow * np.arccos(cosine)
        q1 = np.arctan2(reach[1], reach[0]) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
        return np.array([q1, q2])

    def point(self, q: Array, link: int, distance: float) -> Array:
        """Position of a point on a link, at a distance from that link's joint [m]."""
        if link == 0:
            return self.base + distance * _direction(q[0])
        return self.base + self.lengths[0] * _direction(q[0]) + distance * _direction(q[0] + q[1])

    def tip(self, q: Array) -> Array:
        """Position of the fingertip [m]."""
        return self.point(q, 1, self.lengths[1])

    def jacobian(self, q: Array, link: int = 1, distance: float | None = None) -> Array:
        """Jacobian ``(2, 2)`` of a point on a link, of the fingertip by default [m]."""
        d = float(self.lengths[link] if distance is None else distance)
        q1, q2 = q.tolist()
        if link == 0:
            return np.array([[-d * sin(q1), 0.0], [d * cos(q1), 0.0]])
        l1 = float(self.lengths[0])
        across, along = -d * sin(q1 + q2), d * cos(q1 + q2)
        return np.array([[-l1 * sin(q1) + across, across], [l1 * cos(q1) + along, along]])

    def jacobian_rate_times_velocity(
        self, q: Array, qd: Array, link: int = 1, distance: float | None = None
    ) -> Array:
        """Acceleration of a point on a link at zero joint acceleration [m]/[s^2]."""
        d = float(self.lengths[link] if distance is None else distance)
        (q1, q2), (w1, w2) = q.tolist(), qd.tolist()
        if link == 0:
            pull = -d * w1**2
            return np.array([pull * cos(q1), pull * sin(q1)])
        pull, outer = -float(self.lengths[0]) * w1**2, -d * (w1 + w2) ** 2
        return np.array(
            [
                pull * cos(q1) + outer * cos(q1 + q2),
                pull * sin(q1) + outer * sin(q1 + q2),
            ]
        )

    def link_dynamics(self, q: Array, qd: Array, gravity: float) -> tuple[Array, Array]:
        """M and h of Eq. 1 per mass of each link, ``(2, 2, 2)`` and ``(2, 2)``."""
        inertias, biases = np.empty((2, 2, 2)), np.empty((2, 2))
        for k, c in enumerate(self.centres):
            J = self.jacobian(q, k, c)
            inertial = self.jacobian_rate_times_velocity(q, qd, k, c)
            inertial[1] += gravity
            inertias[k] = J.T @ J + self.inertias[k] * _SPIN[k]
            biases[k] = J.T @ inertial
        return inertias, biases

    def inertia_matrix(self, q: Array, masses: Array) -> Array:
        """M of Eq. 1, shape ``(2, 2)`` [kg m^2]."""
        return np.tensordot(masses, self.link_dynamics(q, np.zeros(2), 0.0)[0], 1)

    def bias(self, q: Array, qd: Array, masses: Array, gravity: float) -> Array:
        """h of Eq. 1: Coriolis, centrifugal and gravity terms [N m]."""
        return masses @ self.link_dynamics(q, qd, gravity)[1]

    def coriolis_matrix(self, q: Array, qd: Array, masses: Array) -> Array:
        """C of Christoffel symbols: ``h = C qd + gravity`` and ``dM/dt - 2 C`` is skew."""
        a = masses[1] * self.lengths[0] * self.centres[1] * np.sin(q[1])
        return a * np.array([[-qd[1], -qd[0] - qd[1]], [qd[0], 0.0]])

    def kinetic_energy(self, q: Array, qd: Array, masses: Array) -> float:
        """Kinetic energy of the links [J]."""
        return 0.5 * float(qd @ self.inertia_matrix(q, masses) @ qd)

    def potential_energy(self, q: Array, masses: Array, gravity: float) -> float:
        """Potential energy of the links, zero at y = 0 [J]."""
        heights = [self.point(q, k, self.centres[k])[1] for k in range(2)]
        return gravity * float(masses @ heights)
