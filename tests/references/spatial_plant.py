"""A spatial hand and its object: geometry of contacts, equations of motion, three ways.

`solve_all_unknowns` solves the four blocks of Eq. 15 together; `reduced_form` is Eq. 18 as
printed; `contact_space` gives relative accelerations at the contacts as a function of forces.
Object coordinates are position and quasi-velocity (v, omega), both along the world's axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.references.spatial_fingers import UP, Fingers

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_UNIT = np.eye(3)
# Rows are S of the unit vectors, number by number.
_CROSS = np.array([np.cross(axis, _UNIT).T.ravel() for axis in _UNIT])


class Parameters(NamedTuple):
    """What may be unknown: true values, or what the controller believes, SI units."""

    link_masses: Array  # (n, 2)
    object_mass: float
    object_inertias: Array  # (3,), about the body's axes
    friction: Array  # (n,)


class State(NamedTuple):
    """Pose and slip of all contacts, and their rates."""

    position: Array  # (3,)
    quaternion: Array  # (4,) as w, x, y, z
    velocity: Array  # (6,), v and omega in world axes
    slip: Array  # (n, 2)
    slip_velocity: Array  # (n, 2)


class Phase(NamedTuple):
    """Along which tangents contacts stick, and gamma of Eq. 7 along the others."""

    sticks: Flags  # (n, 2)
    directions: Array  # (n, 2), zero where it sticks

    @property
    def slipping(self) -> Flags:
        """Contacts that slip along one tangent at least, ``(n,)``."""
        return ~self.sticks.all(axis=1)


def all_stick(n: int) -> Phase:
    """All contacts stick."""
    return Phase(np.ones((n, 2), bool), np.zeros((n, 2)))


def cone_phase(directions: list[ArrayLike | None]) -> Phase:
    """Contacts of a cone: None sticks, a vector slips along it."""
    sticks = [[g is None] * 2 for g in directions]
    gamma = [np.zeros(2) if g is None else np.asarray(g, float) for g in directions]
    return Phase(np.array(sticks), np.array(gamma))


class Kinematics(NamedTuple):
    """Everything that follows from the state without masses, forces or friction."""

    rotation: Array  # (3, 3)
    arms: Array  # (n, 3), from the object's centre of mass to the contacts
    frames: Array  # (n, 3, 3), columns -t_x, -t_y and the inward normal
    q: Array  # (n, 3)
    qd: Array  # (n, 3)
    jacobians: Array  # (n, 3, 3)
    jacobian_rate_times_velocity: Array  # (n, 3)
    A_o: Array  # (3n, 6)
    A_s: Array  # (3n, 2n)
    b: Array  # (3n,), J qdd = -A_o (v', omega') - A_s s'' + b
    W: Array  # (6, 3n)
    inertia_per_mass: Array  # (2, n, 3, 3)
    bias_per_mass: Array  # (2, n, 3)


class Motion(NamedTuple):
    """Accelerations and contact forces."""

    joint_accelerations: Array  # (n, 3)
    acceleration: Array  # (6 + 2n,), object and slip
    forces: Array  # (n, 3), F_x, F_y and F_n of each fingertip on the object


class Reduced(NamedTuple):
    """The matrices of Eq. 17."""

    M: Array  # (6 + 2n, 6 + 2n)
    h: Array  # (6 + 2n,)
    B: Array  # (6 + 2n, 3n)


class Hand(NamedTuple):
    """Geometry of fingers and object.

    Attributes:
        fingers: The fingers.
        anchors: Contact points at zero slip, body frame, ``(n, 3)`` [m].
        faces: t_x, t_y and inward unit normal of the faces as columns, body frame, ``(n, 3, 3)``.
        gravity: Gravitational acceleration along -z [m]/[s^2].
    """

    fingers: Fingers
    anchors: Array
    faces: Array
    gravity: float

    def kinematics(self, state: State) -> Kinematics:
        """Joint motion from the closure of the chains (Eq. 13-16)."""
        n, R = len(self.anchors), rotation_matrix(state.quaternion)
        arms = (self.anchors + (self.faces[:, :, :2] @ state.slip[:, :, None])[:, :, 0]) @ R.T
        frames = R @ self.faces * [-1.0, -1.0, 1.0]
        sliding = -frames[:, :, :2]
        omega, relative = state.velocity[3:], sliding @ state.slip_velocity[:, :, None]
        levers = cross_matrix(arms)
        A_o = np.empty((n, 3, 6))
        A_o[:, :, :3], A_o[:, :, 3:] = -_UNIT, levers
        q = self.fingers.joint_positions(state.position + arms)
        links = self.fingers.links(q)
        J = self.fingers.along(self.fingers.lengths, links.jacobians)
        tip_velocities = -A_o @ state.velocity[:, None] + relative
        qd = np.linalg.solve(J, tip_velocities)[:, :, 0]
        rate = self.fingers.along(self.fingers.lengths, links.biases(qd))
        spin = cross_matrix(omega)
        b = arms @ (spin @ spin).T + 2.0 * relative[:, :, 0] @ spin.T - rate
        moments = levers @ frames
        return Kinematics(
            R, arms, frames, q, qd, J, rate,
            A_o.reshape(3 * n, 6), block_diagonal(-sliding), b.ravel(),
            np.concatenate((frames, moments), axis=1).transpose(1, 0, 2).reshape(6, 3 * n),
            *self.fingers.dynamics_per_mass(links, qd, self.gravity),
        )  # fmt: skip

    def solve_all_unknowns(
        self,
        kin: Kinematics,
        parameters: Parameters,
        phase: Phase,
        torques: Array,
        load: ArrayLike = 0.0,
        spin: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Motion:
        """Solves Eq. 15 for all its unknowns together, nothing eliminated by hand.

        ``load`` is a force and moment on the object from outside, ``(6,)``; ``spin`` the
        object's angular velocity.
        """
        n = len(kin.arms)
        M, h = finger_dynamics(kin, parameters)
        M_o, h_o = self.object_dynamics(kin, parameters, spin)
        alpha, D = friction_rows(phase, parameters.friction)
        J, C = block_diagonal(kin.jacobians), block_diagonal(kin.frames)
        zero = np.zeros
        matrix = np.block(
            [
                [block_diagonal(M), zero((3 * n, 6 + 2 * n)), J.T @ C],
                [zero((6, 3 * n)), M_o, zero((6, 2 * n)), -kin.W],
                [J, kin.A_o, kin.A_s, zero((3 * n, 3 * n))],
                [zero((2 * n, 3 * n + 6)), alpha, D],
            ]
        )
        right = np.concatenate((np.ravel(torques) - h.ravel(), load - h_o, kin.b, zero(2 * n)))
        joints, rest, forces = np.split(np.linalg.solve(matrix, right), (3 * n, 5 * n + 6))
        return Motion(joints.reshape(n, 3), rest, forces.reshape(n, 3))

    def object_dynamics(
        self, kin: Kinematics, parameters: Parameters, spin: ArrayLike
    ) -> tuple[Array, Array]:
        """M_o and h_o, ``(6, 6)`` and ``(6,)``."""
        R, mass = kin.rotation, parameters.object_mass
        inertia = (R * parameters.object_inertias) @ R.T
        M_o = np.zeros((6, 6))
        M_o[:3, :3], M_o[3:, 3:] = mass * _UNIT, inertia
        gyroscopic = cross_matrix(np.asarray(spin)) @ inertia @ spin
        return M_o, np.concatenate((mass * self.gravity * UP, gyroscopic))

    def reduced_form(
        self, kin: Kinematics, parameters: Parameters, phase: Phase, spin: ArrayLike
    ) -> Reduced:
        """M, h and B with tilde, Eq. 18 as printed."""
        M, h = finger_dynamics(kin, parameters)
        M_o, h_o = self.object_dynamics(kin, parameters, spin)
        alpha, D = friction_rows(phase, parameters.friction)
        inverse = np.linalg.inv(kin.jacobians)
        lever = (inverse @ kin.frames).transpose(0, 2, 1)  # J^-T of the J of Eq. 1
        JM = block_diagonal(lever @ M @ inverse)
        bias = JM @ kin.b + (lever @ h[:, :, None]).ravel()
        G = np.vstack((kin.W, -D))
        A = np.hstack((kin.A_o, kin.A_s))
        inertia = -G @ (JM @ A)
        inertia[:6, :6] += M_o
        inertia[6:, 6:] += alpha
        h_all = G @ bias
        h_all[:6] += h_o
        return Reduced(inertia, h_all, G @ block_diagonal(lever))

    def contact_space(
        self,
        kin: Kinematics,
        state: State,
        parameters: Parameters,
        torques: Array,
        load: ArrayLike = 0.0,
    ) -> tuple[Array, Array]:
        """G and c of w = G F + c; w are s_x'', s_y'' and the separation of every contact."""
        M, h = finger_dynamics(kin, parameters)
        M_o, h_o = self.object_dynamics(kin, parameters, state.velocity[3:])
        J, C = kin.jacobians, kin.frames
        tip = C.transpose(0, 2, 1) @ J
        G = kin.W.T @ np.linalg.solve(M_o, kin.W)
        G += block_diagonal(tip @ np.linalg.solve(M, tip.transpose(0, 2, 1)))
        free = J @ np.linalg.solve(M, (np.reshape(torques, h.shape) - h)[:, :, None])
        body = (kin.A_o @ np.linalg.solve(M_o, load - h_o)).reshape(-1, 3)
        drift = free[:, :, 0] + body - kin.b.reshape(-1, 3)
        return G, -(C.transpose(0, 2, 1) @ drift[:, :, None]).ravel()

    def energies(
        self, kin: Kinematics, state: State, parameters: Parameters
    ) -> tuple[float, float]:
        """Kinetic and potential energy of fingers and object, zero at z = 0 [J]."""
        M, _ = finger_dynamics(kin, parameters)
        M_o, _ = self.object_dynamics(kin, parameters, state.velocity[3:])
        moving = np.sum(kin.qd * (M @ kin.qd[:, :, None])[:, :, 0])
        links = self.fingers.potential_energy(kin.q, parameters.link_masses, self.gravity)
        height = parameters.object_mass * self.gravity * state.position[2]
        return 0.5 * float(moving + state.velocity @ M_o @ state.velocity), links + float(height)


def finger_dynamics(kin: Kinematics, parameters: Parameters) -> tuple[Array, Array]:
    """M and h of all fingers, ``(n, 3, 3)`` and ``(n, 3)``."""
    masses = parameters.link_masses.T
    inertia = masses[:, :, None, None] * kin.inertia_per_mass
    bias = masses[:, :, None] * kin.bias_per_mass
    return inertia[0] + inertia[1], bias[0] + bias[1]


def contact_forces(
    kin: Kinematics, parameters: Parameters, torques: Array, acceleration: Array
) -> Array:
    """Forces of the fingertips on the object at an acceleration ``(6 + 2n,)``, ``(n, 3)``."""
    own = own_torques(kin, parameters, acceleration)
    return forces_of_torques(kin, np.reshape(torques, own.shape) - own)


def own_torques(kin: Kinematics, parameters: Parameters, acceleration: Array) -> Array:
    """Torques for the fingers' own motion at an acceleration ``(6 + 2n,)``, ``(n, 3)``."""
    M, h = finger_dynamics(kin, parameters)
    tips = kin.b - kin.A_o @ acceleration[:6] - kin.A_s @ acceleration[6:]
    qdd = np.linalg.solve(kin.jacobians, tips.reshape(-1, 3, 1))
    return (M @ qdd)[:, :, 0] + h


def forces_of_torques(kin: Kinematics, torques: Array) -> Array:
    """Contact forces that torques beyond the own ones press with, ``(n, 3)``."""
    tips = np.linalg.solve(kin.jacobians.transpose(0, 2, 1), torques[:, :, None])
    return (kin.frames.transpose(0, 2, 1) @ tips)[:, :, 0]


def friction_rows(phase: Phase, friction: Array) -> tuple[Array, Array]:
    """alpha and D of Eq. 7: ``alpha s'' + D F = 0``, ``(2n, 2n)`` and ``(2n, 3n)``."""
    n = len(friction)
    rows = np.zeros((n, 2, 3))
    rows[:, :, :2] = np.where(phase.sticks, 0.0, 1.0)[:, :, None] * np.eye(2)
    rows[:, :, 2] = np.where(phase.sticks, 0.0, phase.directions * friction[:, None])
    return np.diag(np.where(phase.sticks, 1.0, 0.0).ravel()), block_diagonal(rows)


def face_frame(normal: Array) -> Array:
    """t_x, t_y and the normal as columns; t_x is the body's z axis along the face.

    Where the face lies flat, its x axis.
    """
    axis = UP if np.hypot(normal[0], normal[1]) > 1e-6 else np.array([1.0, 0.0, 0.0])
    t_x = axis - (axis @ normal) * normal
    t_x /= np.linalg.norm(t_x)
    return np.column_stack((t_x, np.cross(normal, t_x), normal))


def rotation_matrix(quaternion: Array) -> Array:
    """World from body, of a quaternion (w, x, y, z) of any length but zero."""
    w, v = quaternion[0], quaternion[1:]
    S = cross_matrix(v)
    return _UNIT + 2.0 / (quaternion @ quaternion) * (w * S + S @ S)


def quaternion_rate(quaternion: Array, omega: Array) -> Array:
    """dQ/dt = (0, omega) Q / 2."""
    w, v = quaternion[0], quaternion[1:]
    return 0.5 * np.concatenate(([-omega @ v], w * omega + cross_matrix(omega) @ v))


def cross_matrix(vectors: Array) -> Array:
    """S(a) with S(a) b = a x b, for one vector or many."""
    return (vectors @ _CROSS).reshape(*vectors.shape, 3)


def block_diagonal(blocks: Array) -> Array:
    """Blocks of equal shape along the diagonal."""
    count, rows, columns = blocks.shape
    matrix = np.zeros((count, rows, count, columns))
    np.einsum("iaib->iab", matrix)[...] = blocks
    return matrix.reshape(count * rows, count * columns)
