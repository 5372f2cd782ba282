"""Which contacts may stick, slip or open under given torques: every combination is tried.

An open contact carries no force and its fingertip gains distance from the face. Plain NumPy,
written from the equations of docs/model.md: Eq. 15 with one more unknown per contact, the
acceleration of its gap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

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
    """A combination that agrees with the torques.

    Attributes:
        phases: -1, 0 or 1 per contact, or `OPEN`.
        forces: F_x and F_n, ``(n, 2)`` [N].
        slip_accelerations: ``(n,)`` [m]/[s^2].
        gap_accelerations: Of the fingertips away from their faces, ``(n,)`` [m]/[s^2].
    """

    phases: tuple[int, ...]
    forces: Array
    slip_accelerations: Array
    gap_accelerations: Array


class Instant:
    """A state in which every combination of stick, slip and open contacts can be tried.

    Args:
        loop: Hand, true parameters, frictions and load.
        state: The state.
    """

    def __init__(self, loop: ClosedLoop, state: State) -> None:
        self._loop, self._state = loop, state
        self._kin = loop.hand.kinematics(state)
        self._at_rest = np.abs(state.slip_velocity) < REST_SPEED
        self._choices = [
            (0, 1, -1, OPEN) if rests else (int(np.sign(speed)), OPEN)
            for rests, speed in zip(self._at_rest, state.slip_velocity, strict=True)
        ]
        self._inverses: dict[tuple[int, ...], Array | None] = {}

    def answers(self, torques: Array, *, beyond_doubt: bool = True) -> Iterator[Answer]:
        """All combinations that agree with torques on the joints, ``(2n,)`` [N m].

        Contacts that slide keep their direction or open; those at rest may do anything.

        Args:
            torques: Of the joints, ``(2n,)`` [N m].
            beyond_doubt: Whether only those count that keep a distance from their limits, or
                those too that miss them by no more than that.
        """
        share = 1.0 if beyond_doubt else -1.0
        for phases in product(*self._choices):
            answer = self.solve(phases, torques)
            if answer is not None and _agrees(self._loop, answer, self._at_rest, share):
                yield answer

    def solve(self, phases: tuple[int, ...], torques: Array) -> Answer | None:
        """Eq. 15 for all accelerations, those of the gaps too, and forces; None if irregular."""
        if phases not in self._inverses:
            matrix = _equations(self._loop, self._kin, phases)
            regular = _is_regular(self._loop, self._state, phases)
            regular = regular and np.linalg.cond(matrix) < SINGULAR
            self._inverses[phases] = np.linalg.inv(matrix) if regular else None
        inverse, n = self._inverses[phases], len(phases)
        if inverse is None:
            return None
        _, h = self._loop.hand.finger_dynamics(self._kin, self._loop.truth)
        _, h_o = self._loop.hand.object_dynamics(self._loop.truth)
        known = (torques - h, self._loop.load - h_o, self._kin.b, np.zeros(2 * n))
        slips, gaps, forces = np.split((inverse @ np.concatenate(known))[2 * n + 3 :], [n, 2 * n])
        return Answer(phases, forces.reshape(n, 2), slips, gaps)


def _is_regular(loop: ClosedLoop, state: State, phases: Sequence[int]) -> bool:
    """Whether the determinant of M~ is positive for the fingers that touch (no Painleve)."""
    touching = np.flatnonzero(np.array(phases) != OPEN)
    if len(touching) == 0:
        return True
    hand, truth = loop.hand, loop.truth
    rest = hand._replace(
        fingers=tuple(hand.fingers[i] for i in touching),
        anchors=hand.anchors[touching],
        tangents=hand.tangents[touching],
    )
    known = truth._replace(
        link_masses=truth.link_masses[touching], friction=truth.friction[touching]
    )
    part = state._replace(slip=state.slip[touching], slip_velocity=state.slip_velocity[touching])
    reduced = rest.reduced_form(rest.kinematics(part), known, [phases[i] for i in touching])
    return bool(np.linalg.det(reduced.M) > 0.0)


def _equations(loop: ClosedLoop, kin: Kinematics, phases: Sequence[int]) -> Array:
    """The matrix of Eq. 15 with the accelerations of the gaps beside those of the slips.

    The fingertip of an open contact leaves against the inward normal n:
    ``J qdd = ... + sdd t - gdd n`` with ``F = 0``; a closed one has ``gdd = 0``.
    """
    n = len(phases)
    M, _ = loop.hand.finger_dynamics(kin, loop.truth)
    M_o, _ = loop.hand.object_dynamics(loop.truth)
    A_g = block_diagonal([frame[:, 1:] for frame in kin.frames])
    rows = [_contact_rows(i, n, phase, loop.truth.friction[i]) for i, phase in enumerate(phases)]
    zero = np.zeros
    return np.block(
        [
            [M, zero((2 * n, 3 + 2 * n)), kin.J.T],
            [zero((3, 2 * n)), M_o, zero((3, 2 * n)), -kin.W],
            [kin.A_q, kin.A_o, kin.A_s, A_g, zero((2 * n, 2 * n))],
            [zero((2 * n, 2 * n + 3)), np.vstack(rows)],
        ]
    )


def _contact_rows(i: int, n: int, phase: int, friction: float) -> Array:
    """Two equations of contact i in the slip and gap accelerations and the forces, ``(2, 4n)``."""
    rows = np.zeros((2, 4 * n))
    slip, gap, tangential, normal = i, n + i, 2 * n + 2 * i, 2 * n + 2 * i + 1
    if phase == OPEN:
        rows[0, tangential] = rows[1, normal] = 1.0
        return rows
    rows[0, gap] = 1.0
    if phase == 0:
        rows[1, slip] = 1.0
    else:
        rows[1, [tangential, normal]] = 1.0, phase * friction
    return rows


def _agrees(loop: ClosedLoop, answer: Answer, at_rest: Array, share: float) -> bool:
    """Whether forces and accelerations have the signs that the phases ask for.

    They do so by a share of what is in doubt: 1 beyond doubt, -1 where nothing speaks against it.
    """
    accelerations = np.concatenate((answer.slip_accelerations, answer.gap_accelerations))
    least = share * ACCELERATION_DOUBT * (1.0 + np.abs(accelerations).max())
    for i, phase in enumerate(answer.phases):
        tangential, normal = answer.forces[i]
        doubt = share * FORCE_DOUBT * (1.0 + abs(normal))
        margin = loop.static_friction[i] * normal - abs(tangential)
        if phase == OPEN:
            agrees = answer.gap_accelerations[i] > least
        elif normal <= doubt:
            agrees = False
        elif phase == 0:
            agrees = margin > doubt
        else:
            agrees = not at_rest[i] or phase * answer.slip_accelerations[i] > least
        if not agrees:
            return False
    return True
