"""A planar finger of two joints of any kind, from the motion of each link's centre of mass.

Vectors in the plane are complex numbers.
"""

from __future__ import annotations

import cmath
from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import FingerParameters
from slipgrasp.core.scenario.planar_chain import planar_chain_start
from tests.references.finger import Array


class Joint(NamedTuple):
    """A joint in one posture: whether it turns, its origin, its axis if it slides."""

    turns: bool
    origin: complex
    axis: complex


class ChainFinger:
    """The counterpart of `tests.references.finger.Finger` for a chain.

    Args:
        finger: The finger as a scenario describes it.
    """

    def __init__(self, finger: FingerParameters) -> None:
        self._finger = finger
        self._spin = np.array([joint.kind == "revolute" for joint in finger.joints], float)

    def joint_positions(self, tip: Array) -> Array:
        """Inverse kinematics on the branch of the posture [rad, m]."""
        x, y = tip - np.array(self._finger.base)
        start = planar_chain_start(self._finger, (float(x), float(y)))
        assert start is not None
        return np.array(start.positions)

    def jacobian(self, q: Array) -> Array:
        """Jacobian ``(2, 2)`` of the fingertip."""
        return self._columns(q, 1, complex(*self._finger.tip))

    def jacobian_rate_times_velocity(self, q: Array, qd: Array) -> Array:
        """Acceleration of the fingertip at zero joint acceleration [m]/[s^2]."""
        return self._drift(q, qd, 1, complex(*self._finger.tip))

    def link_dynamics(self, q: Array, qd: Array, gravity: float) -> tuple[Array, Array]:
        """M and h of Eq. 1 per mass of each link, ``(2, 2, 2)`` and ``(2, 2)``."""
        inertias, biases = np.empty((2, 2, 2)), np.empty((2, 2))
        for k, joint in enumerate(self._finger.joints):
            point = complex(*joint.centre)
            J = self._columns(q, k, point)
            spin = self._spin * (np.arange(2) <= k)
            inertial = self._drift(q, qd, k, point) + np.array([0.0, gravity])
            inertias[k] = J.T @ J + joint.unit_inertia * np.outer(spin, spin)
            biases[k] = J.T @ inertial
        return inertias, biases

    def inertia_matrix(self, q: Array, masses: Array) -> Array:
        """M of Eq. 1, shape ``(2, 2)``."""
        return np.tensordot(masses, self.link_dynamics(q, np.zeros(2), 0.0)[0], 1)

    def bias(self, q: Array, qd: Array, masses: Array, gravity: float) -> Array:
        """h of Eq. 1: Coriolis, centrifugal and gravity terms."""
        return masses @ self.link_dynamics(q, qd, gravity)[1]

    def _walk(self, q: Array, link: int, point: complex) -> tuple[list[Joint], complex]:
        """The joints up to a link, and the position of a point of it."""
        place, turn, joints = (
            complex(*self._finger.base),
            cmath.rect(1.0, self._finger.attitude),
            [],
        )
        for joint, value in zip(self._finger.joints[: link + 1], q, strict=False):
            place += turn * complex(*joint.place)
            turn *= cmath.rect(1.0, joint.attitude)
            axis = turn * complex(*joint.axis) / abs(complex(*joint.axis))
            turns = joint.kind == "revolute"
            turn *= cmath.rect(1.0, value) if turns else 1.0
            place += 0.0 if turns else axis * value
            joints.append(Joint(turns, place, axis))
        return joints, place + turn * point

    def _columns(self, q: Array, link: int, point: complex) -> Array:
        joints, end = self._walk(q, link, point)
        columns = [1j * (end - j.origin) if j.turns else j.axis for j in joints]
        columns += [0.0] * (2 - len(columns))
        return np.array([np.real(columns), np.imag(columns)])

    def _drift(self, q: Array, qd: Array, link: int, point: complex) -> Array:
        """Sum of the rates of the columns times the joint rates."""
        joints, end = self._walk(q, link, point)
        total, spin = 0j, 0.0
        velocity = self._velocity(joints, qd, end)
        for j, joint in enumerate(joints):
            if joint.turns:
                origin = self._velocity(joints[: j + 1], qd, joint.origin)
                total += 1j * (velocity - origin) * qd[j]
                spin += qd[j]
            else:
                total += 1j * spin * joint.axis * qd[j]
        return np.array([total.real, total.imag])

    @staticmethod
    def _velocity(joints: list[Joint], qd: Array, point: complex) -> complex:
        pairs = zip(joints, qd, strict=False)
        return sum((1j * (point - j.origin) if j.turns else j.axis) * rate for j, rate in pairs)
