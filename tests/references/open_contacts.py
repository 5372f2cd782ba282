"""Which contacts may stick, slip or open under given torques: every combination is tried.

An open contact carries no force and its fingertip gains distance from the face. Plain NumPy,
written from the equations of docs/model.md: Eq. 15 with one more unknown per contact, the
acceleration of its gap, and without the accelerations of the joints and the object.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.closed_loop import ClosedLoop
from tests.references.hand import Kinematics, State, block_diagonal

Array = NDArray[np.float64]

OPEN = 2  # beside the phases -1, 0 and 1

SINGULAR = 1e14  # condition number
REST_SPEED = 3e-9  # slip velocity below which a contact may stick or start either way [m]/[s]
# What an answer must be inside of its limits by, to be one beyond doubt.
FORCE_DOUBT = 1e-7  # of 1 N and the normal force
ACCELERATION_DOUBT = 1e-6  # of 1 m/s^2 and the largest acceleration


class Answer(NamedTuple):
    """A combination that agrees with the torques, or many, one after another.

    Attributes:
        phases: -1, 0 or 1 per contact, or `OPEN`.
        forces: F_x and F_n, ``(n, 2)`` [N].
        slip_accelerations: ``(n,)`` [m]/[s^2].
        gap_accelerations: Of the fingertips away from their faces, ``(n,)`` [m]/[s^2].
    """

    phases: Any
    forces: Array
    slip_accelerations: Array
    gap_accelerations: Array


class Instant:
    """A state in which every combination of stick, slip and open contacts can be tried.

    Slips and gaps of all contacts accelerate by ``w = G F + c``, in the order (s'', gap'') of the
    forces (F_x, F_n). A contact that sticks has w = 0; one that slips F_x + gamma mu F_n = 0 and no
    gap''; an open one F = 0.

    Args:
        loop: Hand, true parameters, frictions and load.
        state: The state.
    """

    def __init__(self, loop: ClosedLoop, state: State) -> None:
        self._loop, self._kin = loop, loop.hand.kinematics(state)
        self._at_rest = np.abs(state.slip_velocity) < REST_SPEED
        choices = [
            (0, 1, -1, OPEN) if rests else (int(np.sign(speed)), OPEN)
            for rests, speed in zip(self._at_rest, state.slip_velocity, strict=True)
        ]
        phases = np.array(list(product(*choices)))
        self._G = _accelerations_per_force(loop, self._kin)
        matrices = _conditions(self._G, phases, loop.truth.friction)
        # The determinant of the reduced inertia has the sign of these (no Painleve).
        regular = (np.linalg.det(matrices) > 0.0) & (np.linalg.cond(matrices) < SINGULAR)
        self._phases, self._inverses = phases[regular], np.linalg.inv(matrices[regular])

    def answers(self, torques: Array, *, beyond_doubt: bool = True) -> Iterator[Answer]:
        """All combinations that agree with torques on the joints, ``(2n,)`` [N m].

        Contacts that slide keep their direction or open; those at rest may do anything.

        Args:
            torques: Of the joints, ``(2n,)`` [N m].
            beyond_doubt: Whether only those count that keep a distance from their limits, or
                those too that miss them by no more than that.
        """
        share = 1.0 if beyond_doubt else -1.0
        answer = self._solve(torques)
        for k in np.flatnonzero(_agree(self._loop, answer, self._at_rest, share)):
            forces, slips, gaps = (values[k] for values in answer[1:])
            yield Answer(tuple(answer.phases[k].tolist()), forces, slips, gaps)

    def solve(self, phases: Sequence[int], torques: Array) -> Answer:
        """Forces and accelerations of one combination, whether it agrees or not."""
        k = int(np.flatnonzero((self._phases == phases).all(axis=1))[0])
        forces, slips, gaps = (values[k] for values in self._solve(torques)[1:])
        return Answer(tuple(phases), forces, slips, gaps)

    def _solve(self, torques: Array) -> Answer:
        """Forces and accelerations of all combinations, one after another."""
        count, n = self._phases.shape
        c = _accelerations_without_force(self._loop, self._kin, torques)
        sticks, closed = self._phases == 0, self._phases != OPEN
        moves = np.stack((sticks, closed), axis=2).reshape(count, 2 * n)
        forces = -(self._inverses @ (moves * c)[:, :, None])[:, :, 0]
        motion = (forces @ self._G.T + c).reshape(count, n, 2)
        # Zero but for rounding where a condition says so.
        motion = np.where(moves.reshape(count, n, 2), 0.0, motion)
        return Answer(self._phases, forces.reshape(count, n, 2), motion[..., 0], motion[..., 1])


def _accelerations_per_force(loop: ClosedLoop, kin: Kinematics) -> Array:
    """G, from the fingers' and the object's equations of motion, ``(2n, 2n)``."""
    M, _ = loop.hand.finger_dynamics(kin, loop.truth)
    M_o, _ = loop.hand.object_dynamics(loop.truth)
    return kin.J @ np.linalg.solve(M, kin.J.T) + kin.W.T @ np.linalg.solve(M_o, kin.W)


def _accelerations_without_force(loop: ClosedLoop, kin: Kinematics, torques: Array) -> Array:
    """c: ``C (s'', gap'') = b - A_q q'' - A_o v'``, C of the frames (-t, n), ``(2n,)``."""
    M, h = loop.hand.finger_dynamics(kin, loop.truth)
    M_o, h_o = loop.hand.object_dynamics(loop.truth)
    joints = np.linalg.solve(M, torques - loop.joint_friction(kin) - h)
    rest = kin.b - kin.A_q @ joints - kin.A_o @ np.linalg.solve(M_o, loop.load - h_o)
    return block_diagonal(kin.frames).T @ rest


def _conditions(G: Array, phases: NDArray[np.int_], friction: Array) -> Array:
    """The matrices of the conditions on the forces, ``(combinations, 2n, 2n)``."""
    count, n = phases.shape
    matrices = np.zeros((count, 2 * n, 2 * n))
    for i in range(n):
        own, (x, y) = phases[:, i], (2 * i, 2 * i + 1)
        matrices[own == 0, x] = G[x]
        matrices[own != 0, x, x] = 1.0
        matrices[:, x, y] += np.where(np.abs(own) == 1, own * friction[i], 0.0)
        matrices[own != OPEN, y] = G[y]
        matrices[own == OPEN, y, y] = 1.0
    return matrices


def _agree(
    loop: ClosedLoop, answer: Answer, at_rest: NDArray[np.bool_], share: float
) -> NDArray[np.bool_]:
    """Which forces and accelerations have the signs that their phases ask for.

    They do so by a share of what is in doubt: 1 beyond doubt, -1 where nothing speaks against it.
    """
    phases, forces, slips, gaps = answer
    largest = np.abs(np.concatenate((slips, gaps), axis=1)).max(axis=1, keepdims=True)
    least = share * ACCELERATION_DOUBT * (1.0 + largest)
    tangential, normal = forces[..., 0], forces[..., 1]
    doubt = share * FORCE_DOUBT * (1.0 + np.abs(normal))
    margin = loop.static_friction * normal - np.abs(tangential)
    slides = ~at_rest | (phases * slips > least)
    closed = (normal > doubt) & np.where(phases == 0, margin > doubt, slides)
    return np.where(phases == OPEN, gaps > least, closed).all(axis=1)
