"""The adaptive law of Theorems 3 and 4 in space, on the rotation vector of the error."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.references.controller import lyapunov_matrix
from tests.references.spatial_contact import Friction
from tests.references.spatial_grasp import cone_bounds, distribute, least_forces, soften
from tests.references.spatial_plant import (
    Hand,
    Kinematics,
    Parameters,
    Phase,
    State,
    contact_forces,
    cross_matrix,
    friction_rows,
    own_torques,
)

Array = NDArray[np.float64]
Distribution = Literal["hold", "softened", "exact"]


class Desired(NamedTuple):
    """Desired motion at one instant."""

    position: Array  # (3,)
    velocity: Array  # (3,)
    acceleration: Array  # (3,)
    rotation: Array  # (3, 3)
    spin: Array  # (3,), angular velocity in world axes
    spin_rate: Array  # (3,)


class Unknowns(NamedTuple):
    """Which parameters are estimated, as dotted keys, and the values of all others."""

    keys: tuple[str, ...]
    known: Parameters

    def fill(self, values: Array) -> Parameters:
        """The parameters with the unknown ones set to ``values``."""
        masses, friction = self.known.link_masses.copy(), self.known.friction.copy()
        mass, inertias = self.known.object_mass, self.known.object_inertias.copy()
        for key, value in zip(self.keys, values, strict=True):
            words = key.split(".")
            if key == "object.mass":
                mass = float(value)
            elif words[1] == "inertias":
                inertias[int(words[2])] = value
            elif words[2] == "friction":
                friction[int(words[1])] = value
            else:
                masses[int(words[1]), int(words[3])] = value
        return Parameters(masses, mass, inertias, friction)


class Errors(NamedTuple):
    """Tracking errors e = (position, -rho, -s) and what relates them to velocities."""

    e: Array  # (6 + 2n,)
    rate: Array  # (6 + 2n,)
    A: Array  # (3, 3), omega = A rho' + exp(rho) omega_des
    A_rate: Array  # (3, 3)
    feedforward: Array  # (3,), d/dt of exp(rho) omega_des

    def in_phase(self, phase: Phase) -> Errors:
        """The same with slips that stick wanted where they are."""
        e = self.e.copy()
        e[6:][phase.sticks.ravel()] = 0.0
        return self._replace(e=e)


class Command(NamedTuple):
    """What the law asks for at one instant."""

    torques: Array  # (n, 3)
    forces: Array  # (n, 3)
    violation: float
    active: tuple[int, ...]
    shortfall: float  # |G F - d|


class Law(NamedTuple):
    """Gains, one entry per coordinate of x (object, slips) or per unknown.

    ``norm_bound`` is infinite for Theorem 3; ``minimum`` and ``maximum`` bound the estimates.
    """

    position_gain: Array
    velocity_gain: Array
    lyapunov_weight: Array  # diagonal of Q for e and for its rate, or all of Q
    adaptation_gain: Array
    grip_safety: float
    least_force: float
    distribution: Distribution
    friction: Friction
    norm_bound: float
    minimum: Array
    maximum: Array

    def commanded_acceleration(
        self, errors: Errors, phase: Phase, desired: Desired, stopping: Array | float = 0.0
    ) -> Array:
        """v of the control law as (v', omega', s''), ``(6 + 2n,)``; zero where contacts stick."""
        v = self.velocity_gain * errors.rate + self.position_gain * errors.e
        rho_rate = -errors.rate[3:6]
        v[:3] += desired.acceleration
        v[3:6] = errors.A @ v[3:6] + errors.A_rate @ rho_rate + errors.feedforward
        v[6:] += np.ravel(stopping)
        v[6:][phase.sticks.ravel()] = 0.0
        return v

    def command(
        self,
        hand: Hand,
        kin: Kinematics,
        believed: Parameters,
        phase: Phase,
        v: Array,
        spin: Array,
        hint: tuple[int, ...] = (),
    ) -> Command:
        """Torques of Eq. 23 and 27: contact forces with the demanded wrench, and the own ones."""
        M_o, h_o = hand.object_dynamics(kin, believed, spin)
        _, D = friction_rows(phase, believed.friction)
        held = self.distribution == "hold"
        slides = ~phase.sticks.ravel()
        whole = np.vstack((kin.W, -D[slides]))
        wanted = np.concatenate((M_o @ v[:6] + h_o, np.zeros(slides.sum())))
        G, d = (kin.W, wanted[:6]) if held else (whole, wanted)
        arm = float(np.sqrt(np.mean(np.sum(kin.arms**2, axis=1))))
        choice = soften(G, d, arm) if self.distribution == "softened" else distribute(G, d)
        slopes = np.repeat(believed.friction[:, None] / self.grip_safety, 2, axis=1)
        slopes = np.where(phase.sticks | held, slopes, np.nan)
        bounds = cone_bounds(slopes, self.least_force, pyramid=self.friction == "pyramid")
        grasp = least_forces(choice, bounds, hint)
        pressed = kin.jacobians.transpose(0, 2, 1) @ (kin.frames @ grasp.forces[:, :, None])
        torques = pressed[:, :, 0] + own_torques(kin, believed, v)
        shortfall = float(np.linalg.norm(whole @ grasp.forces.ravel() - wanted))
        return Command(torques, grasp.forces, grasp.violation, grasp.active, shortfall)

    def weighted_errors(self, reduced_inertia: Array, errors: Errors) -> Array:
        """R of Eq. 46 for the coordinates (position, rho, slips), ``(6 + 2n,)``."""
        P = lyapunov_matrix(self.position_gain, self.velocity_gain, self.lyapunov_weight)
        weighted = (P @ np.concatenate((errors.e, errors.rate)))[len(errors.e) :]
        weighted[3:6] = np.linalg.solve(errors.A.T, weighted[3:6])
        return np.linalg.solve(reduced_inertia.T, weighted)

    def leakage(self, estimates: Array) -> float:
        """sigma_s of Eq. 29."""
        return float(np.clip(np.linalg.norm(estimates) / self.norm_bound - 1.0, 0.0, 1.0))


def left_hand_side(
    hand: Hand,
    kin: Kinematics,
    parameters: Parameters,
    phase: Phase,
    acceleration: Array,
    spin: Array,
) -> Array:
    """M x'' + h of Eq. 17, row by row from the forces of the fingers' own motion."""
    own = contact_forces(kin, parameters, np.zeros(3 * len(kin.arms)), acceleration).ravel()
    M_o, h_o = hand.object_dynamics(kin, parameters, spin)
    alpha, D = friction_rows(phase, parameters.friction)
    body = M_o @ acceleration[:6] + h_o - kin.W @ own
    return np.concatenate((body, alpha @ acceleration[6:] + D @ own))


def regressor(
    hand: Hand, kin: Kinematics, unknowns: Unknowns, phase: Phase, acceleration: Array, spin: Array
) -> tuple[Array, Array]:
    """U ``(6 + 2n, p)`` and the known part of Eq. 21, by superposition."""

    def side(values: Array) -> Array:
        return left_hand_side(hand, kin, unknowns.fill(values), phase, acceleration, spin)

    p = len(unknowns.keys)
    known = side(np.zeros(p))
    columns = [side(unit) - known for unit in np.eye(p)]
    return np.array(columns).reshape(p, len(known)).T, known


def tracking_errors(state: State, rotation: Array, desired: Desired) -> Errors:
    """Errors in the coordinates (position, rho, slips), R = exp(rho) R_des."""
    turned = rotation @ desired.rotation.T
    rho = Rotation.from_matrix(turned).as_rotvec()
    A, _ = left_jacobian(rho, np.zeros(3))
    rho_rate = np.linalg.solve(A, state.velocity[3:] - turned @ desired.spin)
    _, A_rate = left_jacobian(rho, rho_rate)
    swept = cross_matrix(A @ rho_rate) @ turned @ desired.spin + turned @ desired.spin_rate
    e = np.concatenate((desired.position - state.position, -rho, -state.slip.ravel()))
    rate = np.concatenate(
        (desired.velocity - state.velocity[:3], -rho_rate, -state.slip_velocity.ravel())
    )
    return Errors(e, rate, A, A_rate, swept)


def left_jacobian(rho: Array, rate: Array) -> tuple[Array, Array]:
    """A(rho) and its time derivative, as power series: A = sum of S^k / (k + 1)!."""
    S, S_rate = cross_matrix(rho), cross_matrix(rate)
    power, power_rate = np.eye(3), np.zeros((3, 3))
    A, A_rate, factor = np.eye(3), np.zeros((3, 3)), 1.0
    for k in range(1, 40):
        power_rate = power_rate @ S + power @ S_rate
        power = power @ S
        factor /= k + 1
        A, A_rate = A + factor * power, A_rate + factor * power_rate
        if factor * np.abs(power).max() + factor * np.abs(power_rate).max() < 1e-18:
            break
    return A, A_rate
