"""Hand and object: contact geometry, all equations of motion at once, and the reduced form.

Two routes to the same motion: `solve_all_unknowns` solves the four blocks of Eq. 15 for
joint, object and slip accelerations and contact forces together; `reduced_form` is Eq. 18
as printed, written with inverses of block-diagonal matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.references.chain import ChainFinger
from tests.references.finger import Finger

Array = NDArray[np.float64]
Phase = Sequence[int]

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


class Parameters(NamedTuple):
    """What may be unknown: true values, or what the controller believes, SI units."""

    link_masses: Array  # (n, 2)
    object_mass: float
    object_inertia: float
    friction: Array  # (n,)


class State(NamedTuple):
    """The reduced coordinates and their rates."""

    pose: Array  # (3,)
    velocity: Array  # (3,)
    slip: Array  # (n,)
    slip_velocity: Array  # (n,)


@dataclass(frozen=True)
class Kinematics:
    """Everything that follows from the state without masses, forces or friction."""

    q: Array  # (n, 2)
    qd: Array  # (n, 2)
    jacobians: Array  # (n, 2, 2)
    frames: Array  # (n, 2, 2), columns x_c and normal
    A_q: Array  # (2n, 2n)
    A_o: Array  # (2n, 3)
    A_s: Array  # (2n, n)
    b: Array  # (2n,)
    J: Array  # (2n, 2n), the J of Eq. 1 in contact frames
    W: Array  # (3, 2n)
    link_inertias: Array  # (n, 2, 2, 2), M of each finger per mass of each link
    link_biases: Array  # (n, 2, 2), h of each finger per mass of each link

    @cached_property
    def A_q_inverse(self) -> Array:  # noqa: N802
        return np.linalg.inv(self.A_q)

    @cached_property
    def J_inverse_transposed(self) -> Array:  # noqa: N802
        return np.linalg.inv(self.J).T


class Motion(NamedTuple):
    """Accelerations and contact forces."""

    joint_accelerations: Array  # (n, 2)
    acceleration: Array  # (3 + n,), object and slip
    forces: Array  # (n, 2), F_x and F_n of each fingertip on the object


class Reduced(NamedTuple):
    """The matrices of Eq. 17."""

    M: Array  # (3 + n, 3 + n)
    h: Array  # (3 + n,)
    B: Array  # (3 + n, 2n)


class Hand(NamedTuple):
    """Geometry of fingers and object.

    Attributes:
        fingers: The fingers.
        anchors: Contact points at zero slip, object frame, ``(n, 2)`` [m].
        tangents: Unit vectors of positive slip, object frame, ``(n, 2)``.
        gravity: Gravitational acceleration along -y [m]/[s^2].
    """

    fingers: tuple[Finger | ChainFinger, ...]
    anchors: Array
    tangents: Array
    gravity: float

    def tip_positions(self, pose: Array, slip: Array) -> Array:
        """Fingertips in the inertial frame, ``(n, 2)`` [m]."""
        points = self.anchors + slip[:, None] * self.tangents
        return pose[:2] + points @ _rotation(pose[2]).T

    def kinematics(self, state: State, plant: Hand | None = None) -> Kinematics:
        """Joint motion from the closure of the chains (Eq. 13-16).

        ``plant`` is the hand whose joints move so, where this one is only believed in.
        """
        true = (plant or self).fingers
        R = _rotation(state.pose[2])
        spin = state.velocity[2]
        tips = self.tip_positions(state.pose, state.slip)
        rows = []
        for i, finger in enumerate(self.fingers):
            t = R @ self.tangents[i]
            r = tips[i] - state.pose[:2]
            q = true[i].joint_positions(tips[i])
            J = finger.jacobian(q)
            A_o = np.array([[-1.0, 0.0, r[1]], [0.0, -1.0, -r[0]]])
            tip_velocity = -A_o @ state.velocity + t * state.slip_velocity[i]
            own = J if plant is None else true[i].jacobian(q)
            qd = np.linalg.solve(own, tip_velocity)
            b = (
                -finger.jacobian_rate_times_velocity(q, qd)
                - spin**2 * r
                + 2.0 * spin * state.slip_velocity[i] * (TURN @ t)
            )
            normal = np.array([t[1], -t[0]])
            frame = np.array([-t, normal]).T
            moments = r[0] * frame[1] - r[1] * frame[0]
            links = finger.link_dynamics(q, qd, self.gravity)
            W = np.array([*frame, moments])
            rows.append((q, qd, J, frame, A_o, -t[:, None], b, W, *links))
        q, qd, J, frames, A_o, A_s, b, W, inertias, biases = zip(*rows, strict=True)
        return Kinematics(
            q=np.array(q),
            qd=np.array(qd),
            jacobians=np.array(J),
            frames=np.array(frames),
            A_q=block_diagonal(J),
            A_o=np.vstack(A_o),
            A_s=block_diagonal(A_s),
            b=np.concatenate(b),
            J=block_diagonal([C.T @ j for C, j in zip(frames, J, strict=True)]),
            W=np.hstack(W),
            link_inertias=np.array(inertias),
            link_biases=np.array(biases),
        )

    def finger_dynamics(self, kin: Kinematics, parameters: Parameters) -> tuple[Array, Array]:
        """M and h of all fingers, ``(2n, 2n)`` and ``(2n,)``."""
        masses = parameters.link_masses
        M = (masses[:, :, None, None] * kin.link_inertias).sum(axis=1)
        h = (masses[:, :, None] * kin.link_biases).sum(axis=1)
        return block_diagonal(M), h.ravel()

    def object_dynamics(self, parameters: Parameters) -> tuple[Array, Array]:
        """M_o and h_o of Eq. 62."""
        m = parameters.object_mass
        M_o = np.diag([m, m, parameters.object_inertia])
        return M_o, np.array([0.0, m * self.gravity, 0.0])

    def solve_all_unknowns(
        self,
        kin: Kinematics,
        parameters: Parameters,
        phase: Phase,
        torques: Array,
        load: ArrayLike = 0.0,
    ) -> Motion:
        """Solves Eq. 15 for all its unknowns together, nothing eliminated by hand.

        ``load`` is a force and moment on the object from outside, ``(3,)``.
        """
        n = len(self.fingers)
        M, h = self.finger_dynamics(kin, parameters)
        M_o, h_o = self.object_dynamics(parameters)
        alpha, D = friction_rows(phase, parameters.friction)
        # Unknowns: joints, object, slips, forces. Equations: joints, object, contacts, friction.
        joints, body = slice(0, 2 * n), slice(2 * n, 2 * n + 3)
        slips, forces = slice(2 * n + 3, 3 * n + 3), slice(3 * n + 3, 5 * n + 3)
        contacts, friction = slice(2 * n + 3, 4 * n + 3), slice(4 * n + 3, 5 * n + 3)
        matrix = np.zeros((5 * n + 3, 5 * n + 3))
        matrix[joints, joints], matrix[joints, forces] = M, kin.J.T
        matrix[body, body], matrix[body, forces] = M_o, -kin.W
        matrix[contacts, joints], matrix[contacts, body] = kin.A_q, kin.A_o
        matrix[contacts, slips] = kin.A_s
        matrix[friction, slips], matrix[friction, forces] = alpha, D
        right = np.concatenate((torques - h, load - h_o, kin.b, np.zeros(n)))
        solution = np.linalg.solve(matrix, right)
        return Motion(
            joint_accelerations=solution[: 2 * n].reshape(n, 2),
            acceleration=solution[2 * n : 3 * n + 3],
            forces=solution[3 * n + 3 :].reshape(n, 2),
        )

    def reduced_form(self, kin: Kinematics, parameters: Parameters, phase: Phase) -> Reduced:
        """M, h and B with tilde, Eq. 18 as printed."""
        M, h = self.finger_dynamics(kin, parameters)
        M_o, h_o = self.object_dynamics(parameters)
        alpha, D = friction_rows(phase, parameters.friction)
        JMA = kin.J_inverse_transposed @ M @ kin.A_q_inverse
        J_h = kin.J_inverse_transposed @ h
        W = kin.W
        reduced = np.empty((3 + len(D), 3 + len(D)))
        reduced[:3, :3], reduced[:3, 3:] = M_o - W @ JMA @ kin.A_o, -W @ JMA @ kin.A_s
        reduced[3:, :3], reduced[3:, 3:] = D @ JMA @ kin.A_o, alpha + D @ JMA @ kin.A_s
        return Reduced(
            M=reduced,
            h=np.concatenate(
                (
                    h_o + W @ JMA @ kin.b + W @ J_h,
                    -D @ JMA @ kin.b - D @ J_h,
                )
            ),
            B=np.concatenate((W, -D)) @ kin.J_inverse_transposed,
        )

    def kinetic_energy(self, state: State, kin: Kinematics, parameters: Parameters) -> float:
        """Kinetic energy of fingers and object [J]."""
        M, _ = self.finger_dynamics(kin, parameters)
        M_o, _ = self.object_dynamics(parameters)
        qd, v = kin.qd.ravel(), state.velocity
        return 0.5 * float(qd @ M @ qd + v @ M_o @ v)

    def potential_energy(self, state: State, kin: Kinematics, parameters: Parameters) -> float:
        """Potential energy of fingers and object, zero at y = 0 [J]."""
        links = zip(self.fingers, kin.q, parameters.link_masses, strict=True)
        fingers = sum(f.potential_energy(q, m, self.gravity) for f, q, m in links)
        return fingers + parameters.object_mass * self.gravity * float(state.pose[1])


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Blocks of equal shape along the diagonal."""
    rows, columns = blocks[0].shape
    matrix = np.zeros((rows * len(blocks), columns * len(blocks)))
    for i, block in enumerate(blocks):
        matrix[i * rows : (i + 1) * rows, i * columns : (i + 1) * columns] = block
    return matrix


def friction_rows(phase: Phase, friction: Array) -> tuple[Array, Array]:
    """alpha and D of Eq. 10: ``alpha sdd + D F = 0``, shapes ``(n, n)`` and ``(n, 2n)``."""
    n = len(phase)
    alpha, D = np.zeros((n, n)), np.zeros((n, 2 * n))
    for i, gamma in enumerate(phase):
        if gamma == 0:
            alpha[i, i] = 1.0
        else:
            D[i, 2 * i], D[i, 2 * i + 1] = 1.0, gamma * friction[i]
    return alpha, D


def _rotation(angle: float) -> Array:
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s], [s, c]])
