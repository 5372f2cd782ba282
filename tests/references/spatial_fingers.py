"""Fingers of three joints in space, from where their links point and how that changes.

A thin rod moves like two masses on a line, so all of a link's mechanics follows from its
centre and its direction d: forces of inertia are projected onto the Jacobians of both
(d'Alembert's principle), and no Lagrangian formula is copied. All arrays run over the fingers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])


class Links(NamedTuple):
    """Directions d of both links of every finger, and what they are made of, ``(2, n, 3)``."""

    directions: Array
    raised: Array  # d by the angle above the horizontal
    swept: Array  # d by the yaw
    outward: Array  # the horizontal part of d
    sideways: Array  # horizontal unit vectors across it, ``(n, 3)``

    @property
    def jacobians(self) -> Array:
        """Of the directions by the joint angles, ``(2, n, 3, 3)``."""
        jacobians = np.zeros((*self.raised.shape, 3))
        jacobians[..., 0], jacobians[..., 1] = self.swept, self.raised
        jacobians[1, ..., 2] = self.raised[1]
        return jacobians

    def biases(self, qd: Array) -> Array:
        """Second derivatives of the directions at zero joint acceleration, ``(2, n, 3)``."""
        yaw, rate = qd[:, :1], np.array([qd[:, 1:2], qd[:, 1:2] + qd[:, 2:]])
        sine = self.directions[..., 2:]
        turning = -2.0 * rate * yaw * sine * self.sideways - yaw**2 * self.outward
        return turning - rate**2 * self.directions


class Fingers(NamedTuple):
    """Geometry of all fingers; joints are a yaw about the vertical and two pitches.

    Attributes:
        bases: Where the axes of each finger's first two joints meet, ``(n, 3)`` [m].
        lengths: Link lengths, ``(n, 2)`` [m].
        centres: Distance of each link's centre of mass from its joint, ``(n, 2)`` [m].
        inertias: Moment of inertia about an axis across the link through its centre of mass,
            per mass, ``(n, 2)`` [m^2]; about the link it is zero.
        elbows: Sign of the third joint angle, ``(n,)``.
    """

    bases: Array
    lengths: Array
    centres: Array
    inertias: Array
    elbows: Array

    def joint_positions(self, tips: Array) -> Array:
        """Inverse kinematics with the tip in front of the yaw axis, ``(n, 3)`` [rad]."""
        reach = tips - self.bases
        l1, l2 = self.lengths.T
        cosine = (np.sum(reach**2, axis=1) - l1**2 - l2**2) / (2.0 * l1 * l2)
        q3 = self.elbows * np.arccos(cosine)
        radius = np.hypot(reach[:, 0], reach[:, 1])
        inner = np.arctan2(l2 * np.sin(q3), l1 + l2 * cosine)
        q2 = np.arctan2(reach[:, 2], radius) - inner
        return np.array([np.arctan2(reach[:, 1], reach[:, 0]), q2, q3]).T

    def links(self, q: Array) -> Links:
        """How both links of every finger point."""
        height = np.array([q[:, 1], q[:, 1] + q[:, 2]])[..., None]
        yaw, zero = q[:, 0], np.zeros(len(q))
        outward = np.array([np.cos(yaw), np.sin(yaw), zero]).T
        sideways = np.array([-outward[:, 1], outward[:, 0], zero]).T
        c, s = np.cos(height), np.sin(height)
        return Links(
            c * outward + s * UP, -s * outward + c * UP, c * sideways, c * outward, sideways
        )

    def tips(self, q: Array) -> Array:
        """Positions of the fingertips, ``(n, 3)`` [m]."""
        return self.bases + self.along(self.lengths, self.links(q).directions)

    def dynamics_per_mass(self, links: Links, qd: Array, gravity: float) -> tuple[Array, Array]:
        """M and h of Eq. 1 per kilogram of each link, ``(2, n, 3, 3)`` and ``(2, n, 3)``."""
        swings, bends = links.jacobians, links.biases(qd)
        inertias, biases = [], []
        for k in range(2):
            to_centre = self.centres * [1.0, 0.0]
            if k:
                to_centre = np.array([self.lengths[:, 0], self.centres[:, 1]]).T
            centre, swing = self.along(to_centre, swings), swings[k]
            weight = self.inertias[:, k, None, None]
            centre_t, swing_t = centre.transpose(0, 2, 1), weight * swing.transpose(0, 2, 1)
            inertias.append(centre_t @ centre + swing_t @ swing)
            pull = self.along(to_centre, bends) + gravity * UP
            forces = centre_t @ pull[:, :, None] + swing_t @ bends[k][:, :, None]
            biases.append(forces[:, :, 0])
        return np.array(inertias), np.array(biases)

    def potential_energy(self, q: Array, masses: Array, gravity: float) -> float:
        """Potential energy of all links, zero at z = 0 [J]."""
        heights = self.links(q).directions[:, :, 2]
        inner = self.bases[:, 2] + self.centres[:, 0] * heights[0]
        outer = self.bases[:, 2] + self.lengths[:, 0] * heights[0] + self.centres[:, 1] * heights[1]
        return gravity * float(masses[:, 0] @ inner + masses[:, 1] @ outer)

    def along(self, distances: Array, parts: Array) -> Array:
        """What belongs to a point at distances ``(n, 2)`` along both links."""
        shape = (len(distances),) + (1,) * (parts.ndim - 2)
        return distances[:, 0].reshape(shape) * parts[0] + distances[:, 1].reshape(shape) * parts[1]
