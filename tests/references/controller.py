"""The adaptive law of Theorems 3 and 4, with pseudo-inverses and a library's optimisation."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov

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
    differences between unit vectors and zero. It is what object and friction ask for less the
    forces of fingertips that move so without torque.
    """
    body, slip = acceleration[:3], acceleration[3:]
    joints = kin.A_q_inverse @ (kin.b - kin.A_o @ body - kin.A_s @ slip)

    def left_hand_side(values: Array) -> Array:
        believed = unknowns.fill(values)
        M, h = hand.finger_dynamics(kin, believed)
        M_o, h_o = hand.object_dynamics(believed)
        alpha, D = friction_rows(phase, believed.friction)
        forces = -kin.J_inverse_transposed @ (M @ joints + h)
        return np.concatenate((M_o @ body + h_o - kin.W @ forces, alpha @ slip + D @ forces))

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


def lyapunov_matrix(K_p: Array, K_v: Array, Q: Array) -> Array:
    """P for the diagonal of Q or all of it; 0 at positions that have no K_p, left out of xi."""
    if Q.ndim == 1:
        P11, P12, P22 = map(np.diag, lyapunov_matrices(K_p, K_v, Q))
        return np.block([[P11, P12], [P12, P22]])
    return _solved(K_p.tobytes(), K_v.tobytes(), Q.tobytes())


@cache
def _solved(*numbers: bytes) -> Array:
    """P for all of Q, kept: a run asks for the same at every step."""
    K_p, K_v, Q = map(np.frombuffer, numbers)
    Q = Q.reshape(2 * len(K_p), -1)
    A = np.block([[np.zeros((len(K_p),) * 2), np.eye(len(K_p))], [-np.diag(K_p), -np.diag(K_v)]])
    kept = np.flatnonzero(np.append(K_p > 0.0, np.full(len(K_v), True)))
    part = np.ix_(kept, kept)
    P = np.zeros_like(A)
    P[part] = solve_continuous_lyapunov(A[part].T, -Q[part])
    return P


class Law(NamedTuple):
    """Gains, one entry per coordinate of x (object, slips) or per unknown.

    ``norm_bound`` is infinite for Theorem 3; ``minimum`` and ``maximum`` bound the estimates.
    """

    position_gain: Array
    velocity_gain: Array
    lyapunov_weight: Array  # diagonal of Q for e and for its rate, or all of Q
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
        error, rate = tracking_errors(state, desired, phase)
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
        phase: Phase,
        desired: tuple[Array, Array, Array],
        estimates: Array,
    ) -> Array:
        """The update of Eq. 24 and 28, before any projection."""
        r = self.weighted_errors(reduced_estimate, state, phase, desired)
        return self.adaptation_gain * (U.T @ r) - self.leakage(estimates) * estimates

    @property
    def lyapunov_solution(self) -> Array:
        """The solution of Eq. 25."""
        return lyapunov_matrix(self.position_gain, self.velocity_gain, self.lyapunov_weight)

    def weighted_errors(
        self,
        reduced_estimate: Reduced,
        state: State,
        phase: Phase,
        desired: tuple[Array, Array, Array],
    ) -> Array:
        """R of Eq. 46, ``(3 + n,)``."""
        error, rate = tracking_errors(state, desired, phase)
        weighted = self.lyapunov_solution @ np.concatenate((error, rate))
        return np.linalg.solve(reduced_estimate.M.T, weighted[len(error) :])

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
        self, state: State, phase: Phase, desired: tuple[Array, Array, Array], deviation: Array
    ) -> float:
        """V of Eq. 44; ``deviation`` is the true minus the estimated parameters."""
        xi = np.concatenate(tracking_errors(state, desired, phase))
        quadratic = xi @ self.lyapunov_solution @ xi
        return float(quadratic + deviation @ (deviation / self.adaptation_gain))


def tracking_errors(
    state: State, desired: tuple[Array, Array, Array], phase: Phase
) -> tuple[Array, Array]:
    """e and its rate, ``(3 + n,)`` each; a contact that sticks is where it is wanted."""
    error = np.concatenate((desired[0] - state.pose, np.where(phase, -state.slip, 0.0)))
    rate = np.concatenate((desired[1] - state.velocity, -state.slip_velocity))
    return error, rate
