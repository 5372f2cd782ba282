"""Phases: the smooth flow in each, the guards that end it, and which ones are consistent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.closed_loop import ClosedLoop, Evaluation
from tests.references.hand import Kinematics, Motion, State

Array = NDArray[np.float64]
Guard = Callable[[float, Array], float]

REST_SPEED = 1e-9  # slip velocity [m]/[s] below which a contact may change its phase
FORCE_BAND = 1e-7  # relative distance from the friction cone that counts as on it
ACCELERATION_BAND = 1e-7  # slip acceleration [m]/[s^2] that counts as zero
PROBE = 1e-6  # time step of the derivatives that decide on a boundary [s]


@dataclass(frozen=True)
class Flow:
    """The smooth motion in one phase: of the plant, and of the estimates.

    Attributes:
        loop: Hand and controller.
        phase: Phase of the plant.
        piece_time: A time inside the piece of the desired motion.
        belief: Phase the controller acts on, where it is not the plant's.
        torques: Torques that are held; None while the law acts continuously.
        known: Kinematics of the last state, of whatever phase: flows that differ in it share them.
        latest: What the last evaluation gave, by its time and state: guards ask for it again.
    """

    loop: ClosedLoop
    phase: tuple[int, ...]
    piece_time: float
    belief: tuple[int, ...] | None = None
    torques: Array | None = None
    known: dict[bytes, Kinematics] = field(default_factory=dict)
    latest: dict[tuple[float, bytes], Evaluation] = field(default_factory=dict, init=False)

    def evaluate(self, t: float, z: Array) -> Evaluation:
        """Plant and control law."""
        instant = (t, z.tobytes())
        if instant not in self.latest:
            state, estimates = unpack(self.loop, z)
            desired = self.loop.trajectory.desired(t, self.piece_time)
            now = self.loop.evaluate(
                *(state, self.phase, estimates, desired),
                belief=self.belief,
                torques=self.torques,
                kin=self._kinematics(state, z[: len(z) - len(estimates)].tobytes()),
            )
            self.latest.clear()
            self.latest[instant] = now
        return self.latest[instant]

    def _kinematics(self, state: State, coordinates: bytes) -> Kinematics:
        if coordinates not in self.known:
            self.known.clear()
            self.known[coordinates] = self.loop.believed_kinematics(state)
        return self.known[coordinates]

    def motion(self, t: float, z: Array) -> Motion:
        """Accelerations and contact forces of the plant."""
        return self.evaluate(t, z).motion

    def derivative(self, t: float, z: Array) -> Array:
        """dz/dt, estimates included while control is continuous."""
        state, estimates = unpack(self.loop, z)
        now = self.evaluate(t, z)
        acceleration = now.motion.acceleration
        rates = np.zeros(len(estimates))
        if self.torques is None:
            believed = self.belief or self.phase
            desired = self.loop.trajectory.desired(t, self.piece_time)
            raw = self.loop.estimate_rates(
                now.kin, state, believed, estimates, desired, acceleration
            )
            rates = self.loop.law.project_rates(raw, estimates)
        slip_acceleration = np.where(np.array(self.phase) == 0, 0.0, acceleration[3:])
        return np.concatenate(
            (state.velocity, acceleration[:3], state.slip_velocity, slip_acceleration, rates)
        )

    def margins(self, t: float, z: Array) -> Array:
        """mu F_n - |F_x| per contact [N], with the friction of its phase."""
        forces = self.motion(t, z).forces
        sticks = np.array(self.phase) == 0
        friction = np.where(sticks, self.loop.static_friction, self.loop.truth.friction)
        return friction * forces[:, 1] - np.abs(forces[:, 0])

    def rate(self, quantity: Callable[[float, Array], Array], t: float, z: Array) -> Array:
        """Time derivative of a quantity along this flow."""
        ahead = quantity(t + PROBE, z + PROBE * self.derivative(t, z))
        return (ahead - quantity(t, z)) / PROBE

    def is_consistent(self, t: float, z: Array, free: Array) -> bool:
        """Whether forces and slip accelerations agree with the phase of the free contacts."""
        motion = self.motion(t, z)
        normal = motion.forces[:, 1]
        if np.any(normal <= 0.0):
            return False
        for i in np.flatnonzero(free):
            gamma, acceleration = self.phase[i], motion.acceleration[3 + i]
            if gamma == 0:
                ok = self._may_stick(t, z, i, normal[i])
            elif abs(acceleration) < ACCELERATION_BAND:
                slope = self.rate(lambda t, z: self.motion(t, z).acceleration, t, z)[3 + i]
                ok = gamma * slope > 0.0
            else:
                ok = gamma * acceleration > 0.0
            if not ok:
                return False
        return True

    def _may_stick(self, t: float, z: Array, contact: int, normal_force: float) -> bool:
        margin = self.margins(t, z)[contact]
        if abs(margin) < FORCE_BAND * (1.0 + normal_force):
            return bool(self.rate(self.margins, t, z)[contact] >= 0.0)
        return bool(margin > 0.0)


class Stage(NamedTuple):
    """Where a run is: its state, phase, slip path so far and phases over time so far."""

    z: Array
    phase: tuple[int, ...]
    slip_path: Array  # (n,) [m]
    changes: list[tuple[float, tuple[int, ...]]]  # time, phase from then on


class Run(NamedTuple):
    """What a reference run gives: phases over time and states at asked times."""

    changes: list[tuple[float, tuple[int, ...]]]  # time, phase from then on
    slip_path: Array  # (n,) [m]
    times: list[float]
    states: list[Array]  # rows z at `times`
    end: Stage

    def slip_end(self, contact: int) -> float:
        """When a contact stopped slipping for the last time [s]."""
        pairs = zip(self.changes, self.changes[1:], strict=False)
        ends = [b[0] for a, b in pairs if a[1][contact] != 0 and b[1][contact] == 0]
        return ends[-1]


def initial_stage(loop: ClosedLoop) -> Stage:
    """Everything at rest at the start pose, in stick, nothing learnt."""
    n = len(loop.hand.fingers)
    z = np.concatenate((loop.trajectory.start, np.zeros(3 + 2 * n), loop.initial_estimates))
    phase = (0,) * n
    return Stage(z, phase, np.zeros(n), [(0.0, phase)])


def unpack(loop: ClosedLoop, z: Array) -> tuple[State, Array]:
    """State and estimates in the integrated vector."""
    n = len(loop.hand.fingers)
    return State(z[:3], z[3:6], z[6 : 6 + n], z[6 + n : 6 + 2 * n]), z[6 + 2 * n :]


def select_phases(
    flow_in: Callable[[tuple[int, ...]], Flow], loop: ClosedLoop, t: float, z: Array
) -> list[tuple[int, ...]]:
    """All consistent phases; contacts that move keep the direction in which they move.

    Where static friction exceeds that of slip, a contact slips if it is overcome while all
    stick that may, and rests otherwise.
    """
    speeds = unpack(loop, z)[0].slip_velocity
    free = np.abs(speeds) < REST_SPEED
    choices = [(0, 1, -1) if f else (int(np.sign(v)),) for f, v in zip(free, speeds, strict=True)]
    found = [p for p in product(*choices) if flow_in(p).is_consistent(t, z, free)]
    excess = free & (loop.static_friction > loop.truth.friction)
    resting = tuple(0 if f else int(np.sign(v)) for f, v in zip(free, speeds, strict=True))
    loose = excess & (flow_in(resting).margins(t, z) < FORCE_BAND)
    ranks = [
        (np.sum(loose & (np.array(p) == 0)), np.sum(excess & (np.array(p) != 0))) for p in found
    ]
    return [p for p, rank in zip(found, ranks, strict=True) if rank == min(ranks)]


def guards(flow: Flow) -> Iterator[Guard]:
    """One event function per contact: leaving the cone, or the end of its slip."""
    n = len(flow.phase)
    for i, gamma in enumerate(flow.phase):

        def guard(t: float, z: Array, i: int = i, gamma: int = gamma) -> float:
            if gamma == 0:
                return float(flow.margins(t, z)[i])
            return float(gamma * z[6 + n + i])

        guard.terminal = True
        guard.direction = -1.0
        yield guard


def at_rest(loop: ClosedLoop, z: Array) -> Array:
    """Sets the slip velocities that vanish to exactly zero."""
    n = len(loop.hand.fingers)
    z[6 + n : 6 + 2 * n][np.abs(z[6 + n : 6 + 2 * n]) < REST_SPEED] = 0.0
    return z
