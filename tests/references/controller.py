"""The adaptive law of Theorems 3 and 4, with pseudo-inverses and a library's optimisation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.grasp import Limits, least_forces
from tests.references.hand import (
    Hand,
    Kinematics,
    Parameters,
    Phase,
    Reduced,
    State,
    friction_rows,
)

Array = NDArray[np.float64]


class Unknowns(NamedTuple):
    """Which parameters are estimated, as dotted keys, and the values of all others."""

    keys: tuple[str, ...]
    known: Parameters

    def fill(self, values: Array) -> Parameters:
        """The parameters with the unknown ones set to ``values``."""
        link_masses, friction = self.known.link_masses.copy(), self.known.friction.copy()
        mass, inertia = self.known.object_mass, self.known.object_inertia
        for key, value in zip(self.keys, values, strict=True):
            words = key.split(".")
            if key == "object.mass":
                mass = float(value)
            elif key == "object.inertia":
                inertia = float(value)
            elif words[2] == "friction":
                friction[int(words[1])] = value
            else:
                link_masses[int(words[1]), int(words[3])] = value
        return Parameters(link_masses, mass, inertia, friction)


class Command(NamedTuple):
    """Torques, how far the forces they ask for leave the estimated cones [N], and the forces."""

    torques: Array
    violation: float
    forces: Array


def regressor(
    hand: Hand, kin: Kinematics, unknowns: Unknowns, phase: Phase, acceleration: Array
) -> tuple[Array, Array]:
    """U ``(3 + n, p)`` and the known part ``(3 + n,)`` of Eq. 21, by superposition.

    The left-hand side of Eq. 17 is affine in the unknowns, so U's columns are its
    differences between unit vectors and zero.
    """

    def left_hand_side(values: Array) -> Array:
        reduced = hand.reduced_form(kin, unknowns.fill(values), phase)
        return reduced.M @ acceleration + reduced.h

    p = len(unknowns.keys)
    known = left_hand_side(np.zeros(p))
    columns = [left_hand_side(unit) - known for unit in np.eye(p)]
    return np.array(columns).reshape(p, len(known)).T, known


def lyapunov_matrices(K_p: Array, K_v: Array, Q: Array) -> tuple[Array, Array, Array]:
    """Diagonals of P11, P12 and P22 (Eq. 25), the limit where K_p is zero."""
    tracked = K_p > 0.0
    P12 = np.where(tracked, Q / (2.0 * np.where(tracked, K_p, 1.0)), 0.0)
    P22 = (Q / 2.0 + P12) / K_v
    P11 = np.where(tracked, K_p * P22 + K_v * P12, 0.0)
    return P11, P12, P22


class Law(NamedTuple):
    """Gains, one entry per coordinate of x (object, slips) or per unknown.

    ``norm_bound`` is infinite for Theorem 3; ``minimum`` and ``maximum`` bound the estimates.
    """

    position_gain: Array
    velocity_gain: Array
    lyapunov_weight: Array
    adaptation_gain: Array
    grip_safety: float
    normal_forces: tuple[float, float]  # least and largest [N]
    torque_limit: float  # [N m]
    squeezes: bool
    holds: bool  # every contact inside its cone, slipping or not
    norm_bound: float
    minimum: Array
    maximum: Array

    def commanded_acceleration(
        self, state: State, phase: Phase, desired: tuple[Array, Array, Array]
    ) -> Array:
        """v of the control law; zero for sticking contacts."""
        error, rate = tracking_errors(state, desired)
        v = self.velocity_gain * rate + self.position_gain * error
        v[:3] += desired[2]
        v[3:][np.asarray(phase) == 0] = 0.0
        return v

    def command(
        self,
        hand: Hand,
        kin: Kinematics,
        believed: Parameters,
        phase: Phase,
        v: Array,
    ) -> Command:
        """Torques of Eq. 23 and 27 with the grasp force of docs/model.md."""
        if self.holds:
            phase = (0,) * len(phase)
        reduced = hand.reduced_form(kin, believed, phase)
        plain = np.linalg.pinv(reduced.B, rcond=1e-10) @ (reduced.M @ v + reduced.h)
        sticks = np.asarray(phase) == 0
        freedom = 2 * len(sticks) - 3 - np.sum(~sticks)
        M, h = hand.finger_dynamics(kin, believed)
        qdd = np.linalg.solve(kin.A_q, kin.b - kin.A_o @ v[:3] - kin.A_s @ v[3:])
        own = h + M @ qdd
        forces = np.linalg.solve(kin.J.T, plain - own)
        if not self.squeezes or freedom <= 0:
            return Command(plain, 0.0, forces)
        cones = np.where(sticks, believed.friction / self.grip_safety, np.nan)
        limits = Limits(cones, *self.normal_forces, kin.J.T, own, self.torque_limit)
        _, D = friction_rows(phase, believed.friction)
        G = np.vstack((kin.W, D[~sticks]))
        forces, violation = least_forces(G, G @ forces, limits)
        return Command(kin.J.T @ forces + own, violation, forces)

    def estimate_rates(
        self,
        reduced_estimate: Reduced,
        U: Array,
        state: State,
        desired: tuple[Array, Array, Array],
        estimates: Array,
    ) -> Array:
        """The update of Eq. 24 and 28, before any projection."""
        r = self.weighted_errors(reduced_estimate, state, desired)
        return self.adaptation_gain * (U.T @ r) - self.leakage(estimates) * estimates

    def weighted_errors(
        self, reduced_estimate: Reduced, state: State, desired: tuple[Array, Array, Array]
    ) -> Array:
        """R of Eq. 46, ``(3 + n,)``."""
        error, rate = tracking_errors(state, desired)
        _, P12, P22 = lyapunov_matrices(
            self.position_gain, self.velocity_gain, self.lyapunov_weight
        )
        return np.linalg.solve(reduced_estimate.M.T, P12 * error + P22 * rate)

    def leakage(self, estimates: Array) -> float:
        """sigma_s of Eq. 29."""
        return float(np.clip(np.linalg.norm(estimates) / self.norm_bound - 1.0, 0.0, 1.0))

    def project_rates(self, rates: Array, estimates: Array) -> Array:
        """Rates that do not leave the bounds of the estimates."""
        outward = ((estimates <= self.minimum) & (rates < 0.0)) | (
            (estimates >= self.maximum) & (rates > 0.0)
        )
        return np.where(outward, 0.0, rates)

    def lyapunov_value(
        self, state: State, desired: tuple[Array, Array, Array], deviation: Array
    ) -> float:
        """V of Eq. 44; ``deviation`` is the true minus the estimated parameters."""
        error, rate = tracking_errors(state, desired)
        P11, P12, P22 = lyapunov_matrices(
            self.position_gain, self.velocity_gain, self.lyapunov_weight
        )
        quadratic = P11 @ error**2 + 2.0 * P12 @ (error * rate) + P22 @ rate**2
        return float(quadratic + deviation @ (deviation / self.adaptation_gain))


def tracking_errors(state: State, desired: tuple[Array, Array, Array]) -> tuple[Array, Array]:
    """e and its rate, ``(3 + n,)`` each."""
    error = np.concatenate((desired[0] - state.pose, -state.slip))
    rate = np.concatenate((desired[1] - state.velocity, -state.slip_velocity))
    return error, rate
