"""The composite law: recursive least squares beside the tracking term, in matrices.

Written from docs/model.md, Composite adaptation. The rows Y and y are differences of the
equations between values of the unknowns, as the regressor of the other laws is.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from tests.references.closed_loop import ClosedLoop
from tests.references.controller import regressor
from tests.references.hand import Kinematics, Parameters, Phase, State

Array = NDArray[np.float64]

SURPRISE = 6.0  # standard deviations
DEVIATIONS = {"inertia": 0.1}  # of what is not known, where the scenario says nothing
DEVIATION = 3.0
REFERENCE_PERIOD = 1e-3  # that `controller.forgetting` is stated for [s]


class Composite:
    """What the law remembers from tick to tick: the covariance of its estimates.

    Args:
        scenario: With the composite law, exact sensors and no latency.
    """

    def __init__(self, scenario: Scenario) -> None:
        law = scenario.controller
        keys = [estimate.parameter for estimate in scenario.estimates]
        left_out = [DEVIATIONS.get(key.rpartition(".")[2], DEVIATION) for key in keys]
        given = left_out if law.initial_deviation is None else law.initial_deviation
        self.start = np.broadcast_to(given, len(keys)).astype(float) ** 2
        self.covariance = np.diag(self.start)
        self._law = law
        self._friction = [_finger_of_friction(key) for key in keys]
        self._slipped = np.zeros(len(scenario.fingers), bool)

    def rates(
        self,
        loop: ClosedLoop,
        kin: Kinematics,
        state: State,
        belief: Phase,
        phase: Phase,
        estimates: Array,
        desired: tuple[Array, Array, Array],
        torques: Array,
        forces: Array,
        acceleration: Array,
        period: float,
    ) -> Array:
        """Rates until the next tick.

        Args:
            loop: Hand and law.
            kin: At the tick.
            state: At the tick.
            belief: Phases before the new torque acts.
            phase: Phases after.
            estimates: At the tick.
            desired: Desired pose, velocity, acceleration.
            torques: That act from the tick on.
            forces: That they ask for at the contacts, ``(2n,)``.
            acceleration: Under them.
            period: Control period [s].
        """
        learnt = estimates.copy()
        for row, value, deviation in self._rows(loop, kin, phase, torques, acceleration):
            learnt = self._take(learnt, row, value, deviation)
        self._forget(self._law.forgetting ** (period / REFERENCE_PERIOD))
        U, _ = regressor(loop.believed_hand, kin, loop.unknowns, belief, acceleration)
        reduced = loop.believed_hand.reduced_form(kin, loop.unknowns.fill(estimates), belief)
        weighted = loop.law.weighted_errors(reduced, state, belief, desired)
        tracking = self.covariance @ U.T @ weighted
        self._slipped |= np.asarray(phase) != 0
        probed = self._probed(loop.unknowns.fill(estimates).friction, forces)
        grown = self._law.probing * np.where(probed, estimates, 0.0)
        return (learnt - estimates) / period + tracking + grown

    def _probed(self, friction: Array, forces: Array) -> Array:
        """Unknowns that are the friction of a contact that bounds the grip and never slipped."""
        along, normal = np.abs(forces[::2]), forces[1::2]
        bound = along > (1.0 - 1e-6) * friction / self._law.grip_safety * normal
        wanted = bound & ~self._slipped
        return np.array([i is not None and wanted[i] for i in self._friction])

    def _rows(
        self,
        loop: ClosedLoop,
        kin: Kinematics,
        phase: Phase,
        torques: Array,
        acceleration: Array,
    ) -> Iterator[tuple[Array, float, float]]:
        """Y, y and the standard deviation of every equation: object, then slipping contacts."""

        def missing(values: Array) -> Array:
            return _missing(loop, kin, phase, loop.unknowns.fill(values), torques, acceleration)

        y = missing(np.zeros(len(self.start)))
        Y = np.array([y - missing(unit) for unit in np.eye(len(self.start))]).T
        arms = kin.W[2].reshape(-1, 2)  # across and along the normal: lengths as in the world
        deviations = np.full(len(y), self._law.force_noise)
        deviations[2] *= np.sqrt(np.mean(np.sum(arms**2, axis=1)))
        yield from zip(Y, y, deviations, strict=True)

    def _take(self, values: Array, row: Array, value: float, deviation: float) -> Array:
        """One step of recursive least squares; a surprise first forgets what it concerns."""
        error = value - row @ values
        if row @ self.covariance @ row == 0.0:
            return values
        if abs(error) > SURPRISE * np.sqrt(deviation**2 + row @ self.covariance @ row):
            diagonal = np.diag(self.covariance).copy()
            diagonal[row != 0.0] = np.maximum(diagonal, self.start)[row != 0.0]
            np.fill_diagonal(self.covariance, diagonal)
        gain = self.covariance @ row / (deviation**2 + row @ self.covariance @ row)
        self.covariance = self.covariance - np.outer(gain, row @ self.covariance)
        self.covariance = 0.5 * (self.covariance + self.covariance.T)
        return values + gain * error

    def _forget(self, kept: float) -> None:
        """Variances grow, at most to their start; correlations stay what they are."""
        grown = self.covariance / kept
        shrink = np.sqrt(np.minimum(1.0, self.start / np.diag(grown)))
        self.covariance = grown * np.outer(shrink, shrink)


def stopping(scenario: Scenario, state: State, belief: Phase, period: float) -> Array:
    """What the law adds to the commanded slip accelerations so that a slip ends, ``(n,)``."""
    most = scenario.controller.slip_stop
    speed = np.abs(state.slip_velocity)
    return -np.minimum(most, speed / period + 0.01 * most) * np.asarray(belief)


def _missing(
    loop: ClosedLoop,
    kin: Kinematics,
    phase: Phase,
    believed: Parameters,
    torques: Array,
    acceleration: Array,
) -> Array:
    """Force of the fingertips less what object and friction ask for; zero at the truth."""
    hand = loop.believed_hand
    M, h = hand.finger_dynamics(kin, believed)
    qdd = kin.A_q_inverse @ (kin.b - kin.A_o @ acceleration[:3] - kin.A_s @ acceleration[3:])
    forces = kin.J_inverse_transposed @ (torques - h - M @ qdd)
    M_o, h_o = hand.object_dynamics(believed)
    body = kin.W @ forces - M_o @ acceleration[:3] - h_o
    sliding = [
        -(along + gamma * mu * normal)
        for (along, normal), gamma, mu in zip(
            forces.reshape(-1, 2), phase, believed.friction, strict=True
        )
        if gamma
    ]
    return np.append(body, sliding)


def _finger_of_friction(key: str) -> int | None:
    words = key.split(".")
    return int(words[1]) if words[-1] == "friction" else None
