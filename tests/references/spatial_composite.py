"""The composite law in space: recursive least squares beside the tracking term, in matrices."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.spatial_law import Unknowns
from tests.references.spatial_plant import Hand, Kinematics, Phase, contact_forces

Array = NDArray[np.float64]

REFERENCE_PERIOD = 1e-3  # that the forgetting is stated for [s]


class Learning(NamedTuple):
    """Settings of the composite law.

    Attributes:
        deviations: First standard deviations of the unknowns, ``(p,)``.
        force_noise: Standard deviation of a contact force [N].
        forgetting: Factor of a variance over 1 ms.
        slip_stop: Largest deceleration asked of a slipping contact [m]/[s^2].
    """

    deviations: Array
    force_noise: float
    forgetting: float
    slip_stop: float

    def stopping(self, slip_velocity: Array, phase: Phase, period: float) -> Array:
        """What is added to the commanded slip accelerations so that a slip ends, ``(n, 2)``."""
        speed = np.linalg.norm(slip_velocity, axis=1, keepdims=True)
        size = np.minimum(self.slip_stop, speed / period + 0.01 * self.slip_stop)
        return -size * phase.directions


class Instant(NamedTuple):
    """What the law knows at a tick, after the new torque acts."""

    hand: Hand
    kin: Kinematics
    unknowns: Unknowns
    phase: Phase  # under the new torque
    torques: Array  # (n, 3)
    acceleration: Array  # (6 + 2n,)
    spin: Array  # (3,)

    def missing(self, values: Array) -> Array:
        """What object and slipping contacts lack, ``(6 + slips,)``; zero at the truth."""
        believed = self.unknowns.fill(values)
        forces = contact_forces(self.kin, believed, self.torques, self.acceleration)
        M_o, h_o = self.hand.object_dynamics(self.kin, believed, self.spin)
        body = self.kin.W @ forces.ravel() - M_o @ self.acceleration[:6] - h_o
        rows = zip(forces, self.phase.sticks, self.phase.directions, believed.friction, strict=True)
        return np.append(body, [row for contact in rows for row in _slip_rows(*contact)])


def _slip_rows(force: Array, sticks: Array, gamma: Array, mu: float) -> Iterator[float]:
    """F_t gamma + mu F_n of what slips, along the direction of slip or along each tangent."""
    if not sticks.any():
        size = float(np.linalg.norm(gamma))
        if size < 1.2:  # one direction of the cone; two of the pyramid have root two
            yield -float(gamma @ force[:2]) - mu * force[2]
            return
    for k in np.flatnonzero(~sticks):
        yield -gamma[k] * force[k] - mu * force[2]


class Composite:
    """What the law remembers from tick to tick: the covariance of its estimates."""

    def __init__(self, learning: Learning) -> None:
        self.learning = learning
        self.start = learning.deviations**2
        self.covariance = np.diag(self.start)

    def learn(
        self,
        now: Instant,
        estimates: Array,
        gradient: Array,
        period: float,
        noise: Array | float = 0.0,
        trust: Array | float = 1.0,
    ) -> Array:
        """The estimates of the next tick before their bounds, ``(p,)``.

        Args:
            now: The tick.
            estimates: Before it.
            gradient: U^T r of Eq. 24, ``(p,)``.
            period: Control period [s].
            noise: Variance that noise of the acceleration adds to each row.
            trust: By which the deviation of each row is divided.
        """
        tracking = period * self.covariance @ gradient
        y = now.missing(np.zeros(len(estimates)))
        Y = np.array([y - now.missing(unit) for unit in np.eye(len(estimates))]).T
        deviations = np.full(len(y), self.learning.force_noise)
        deviations[3:6] *= np.sqrt(np.mean(np.sum(now.kin.arms**2, axis=1)))
        deviations = np.sqrt(deviations**2 + noise) / np.maximum(trust, 1e-9)
        learnt = estimates.copy()
        for row, value, deviation in zip(Y, y, deviations, strict=True):
            gain = self.covariance @ row / (deviation**2 + row @ self.covariance @ row)
            learnt = learnt + gain * (value - row @ learnt)
            self.covariance = self.covariance - np.outer(gain, row @ self.covariance)
            self.covariance = 0.5 * (self.covariance + self.covariance.T)
        self._forget(self.learning.forgetting ** (period / REFERENCE_PERIOD))
        return learnt + tracking

    def _forget(self, kept: float) -> None:
        """Variances grow, at most to their start; correlations stay what they are."""
        grown = self.covariance / kept
        shrink = np.sqrt(np.minimum(1.0, self.start / np.diag(grown)))
        self.covariance = grown * np.outer(shrink, shrink)
