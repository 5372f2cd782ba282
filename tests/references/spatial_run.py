"""A run in space with sampled control: torques held over each period, Radau or DOP853 between.

Events are located by shortening the step that passed one, so that its end is an end of the
integrator and no interpolation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, Radau
from scipy.optimize import brentq

from tests.references.spatial_composite import Composite, Instant, Learning
from tests.references.spatial_contact import (
    Problem,
    Selection,
    margins,
    moving_directions,
    select,
)
from tests.references.spatial_law import Command, Desired, Law, Unknowns, regressor, tracking_errors
from tests.references.spatial_plant import (
    Hand,
    Kinematics,
    Parameters,
    Phase,
    State,
    all_stick,
    contact_forces,
    quaternion_rate,
)

Array = NDArray[np.float64]

STOP_SPEED = 3e-9  # a slip ends here [m]/[s]
FROZEN_BELOW = 3e-8  # slip speed below which the direction at the onset is kept [m]/[s]
STOPS_TOGETHER = 1e-8  # [s]
TOGETHER_SPEED = 1e-7  # [m]/[s]
ON_CONE = 1e-11  # share of a cone beyond which a contact has left it
FIRED = 1e-12  # below which a located guard counts as zero


class World(NamedTuple):
    """All that decides a run.

    Attributes:
        hand: Fingers and contacts.
        truth: Parameters of the plant.
        unknowns: What the law estimates.
        law: The law.
        learning: Settings of the composite law; None for the theorems.
        desired: Desired motion over time.
        position: Of the object at the start [m].
        estimates: First estimates, ``(p,)``.
        period: Of the control [s].
        tolerance: Relative, of the integration.
        quaternion: Of the object at the start.
    """

    hand: Hand
    truth: Parameters
    unknowns: Unknowns
    law: Law
    learning: Learning | None
    desired: Callable[[float], Desired]
    position: Array
    estimates: Array
    period: float = 1e-3
    tolerance: float = 1e-10
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass
class Run:
    """What a run gives."""

    outcome: str = "completed"
    end_time: float = 0.0
    changes: list[tuple[float, Phase]] = field(default_factory=list)
    slip_ends: Array = field(default_factory=lambda: np.zeros(0))  # last end per contact [s]
    slip_path: Array = field(default_factory=lambda: np.zeros(0))  # [m]
    slip: Array = field(default_factory=lambda: np.zeros(0))  # at the end, (n, 2) [m]
    violations: list[tuple[float, float]] = field(default_factory=list)  # time, excess [N]
    times: list[float] = field(default_factory=list)
    states: list[State] = field(default_factory=list)
    errors: list[Array] = field(default_factory=list)
    estimates: list[Array] = field(default_factory=list)
    forces: list[Array] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    peak_force: float = 0.0
    dissipated: float = 0.0
    ledger: float = 0.0  # energy that is missing at the end [J]
    evaluations: int = 0


class Guards(NamedTuple):
    """What falls through zero at an event."""

    spare: Array  # share of the cone that is left where a contact sticks, ``(n, 2)``
    ends: Array  # speed above rest where it slips, ``(n, 2)``
    normal: Array  # normal forces, ``(n,)``

    def least(self) -> float:
        """The one that falls first."""
        return float(min(part.min() for part in self))


class Simulator:
    """Goes from tick to tick.

    Args:
        world: What is simulated.
        keep: Times at which state, errors, estimates and forces are kept [s].
    """

    def __init__(self, world: World, keep: tuple[float, ...] = ()) -> None:
        self.world, self.n = world, len(world.hand.anchors)
        self.keep = keep
        self.run = Run()
        rest = np.zeros((self.n, 2))
        start = State(world.position, np.array(world.quaternion), np.zeros(6), rest, rest)
        self.z = _pack(start, np.zeros(2 + self.n))
        self.phase = all_stick(self.n)
        self.frozen = np.zeros(self.n, bool)
        self.estimates = world.estimates.copy()
        self.torques = np.zeros((self.n, 3))
        self.composite = Composite(world.learning) if world.learning else None
        self.hint: tuple[int, ...] = ()
        self.ends = np.full(self.n, np.nan)
        self.energy = self._energy()

    def simulate(self, duration: float) -> Run:
        """The run up to a duration, or to where it ends early."""
        ticks = round(duration / self.world.period)
        run = self.run
        for k in range(ticks + 1):
            t = k * self.world.period
            if not self._tick(t) or k == ticks or not self._advance(t, t + self.world.period):
                break
        run.slip_path, run.slip_ends = self.z[-self.n :].copy(), self.ends
        run.slip = _state(self.z, self.n).slip.copy()
        run.end_time = t if run.outcome == "completed" else run.end_time
        run.dissipated = float(self.z[-self.n - 1])
        supplied = float(self.z[-self.n - 2])
        run.ledger = self._energy() - self.energy - supplied + run.dissipated
        return run

    def _energy(self) -> float:
        state = _state(self.z, self.n)
        kin = self.world.hand.kinematics(state)
        return sum(self.world.hand.energies(kin, state, self.world.truth))

    def _tick(self, t: float) -> bool:
        """The law at a tick, the phases under its torque, and the next estimates."""
        world, law, hand = self.world, self.world.law, self.world.hand
        state = _state(self.z, self.n)
        kin, desired, spin = hand.kinematics(state), world.desired(t), state.velocity[3:]
        before = self._turned(self.phase, self.frozen, state.slip_velocity)
        believed = world.unknowns.fill(self.estimates)
        errors = tracking_errors(state, kin.rotation, desired).in_phase(before)
        stopping = np.zeros((self.n, 2))
        if world.learning:
            stopping = world.learning.stopping(state.slip_velocity, before, world.period)
        v = law.commanded_acceleration(errors, before, desired, stopping)
        command = law.command(hand, kin, believed, before, v, spin, self.hint)
        self.hint, self.torques = command.active, command.torques
        if command.violation > 1e-9:
            self.run.violations.append((t, command.violation))
        if not self._select(t, np.zeros((self.n, 2), bool)):
            return False
        acceleration, forces = self._plant(self.z, self.phase)
        self.run.peak_force = max(self.run.peak_force, forces[:, 2].max())
        if any(abs(t - time) < 1e-9 for time in self.keep):
            self._keep(t, state, errors.e, forces, command)
        U, _ = regressor(hand, kin, world.unknowns, before, acceleration, spin)
        inertia = hand.reduced_form(kin, believed, before, spin).M
        gradient = U.T @ law.weighted_errors(inertia, errors)
        if self.composite is None:
            rates = law.adaptation_gain * gradient - law.leakage(self.estimates) * self.estimates
            learnt = self.estimates + world.period * rates
        else:
            now = Instant(hand, kin, world.unknowns, self.phase, self.torques, acceleration, spin)
            learnt = self.composite.learn(now, self.estimates, gradient, world.period)
        self.estimates = np.clip(learnt, law.minimum, law.maximum)
        return True

    def _keep(self, t: float, state: State, e: Array, forces: Array, command: Command) -> None:
        run = self.run
        run.times.append(t)
        run.states.append(state)
        run.errors.append(e)
        run.estimates.append(self.estimates.copy())
        run.forces.append(forces)
        run.commands.append(command)

    def _problem(self, leaving: NDArray[np.bool_]) -> Problem:
        state = _state(self.z, self.n)
        kin = self.world.hand.kinematics(state)
        G, c = self.world.hand.contact_space(kin, state, self.world.truth, self.torques)
        moving, directions = moving_directions(state.slip_velocity, self.world.law.friction)
        keep = self.frozen[:, None] & ~self.phase.sticks
        moving, directions = moving | keep, np.where(keep, self.phase.directions, directions)
        mu = self.world.truth.friction
        return Problem(G, c, mu, moving, directions, leaving, self.world.law.friction)

    def _select(self, t: float, leaving: NDArray[np.bool_]) -> bool:
        """New phases at an event or a jump of the torque."""
        problem = self._problem(leaving)
        velocities = self.z[13 + 2 * self.n : 13 + 4 * self.n].reshape(self.n, 2)
        velocities[~problem.moving] = 0.0
        found: Selection = select(problem)
        if found.phase is None:
            separated = np.any(found.forces[:, 2] <= 0.0)
            self.run.outcome = "separated" if separated else "inconsistent"
            self.run.end_time = t
            return False
        stopped = self.phase.slipping & ~found.phase.slipping
        self.ends[stopped] = t
        if not _equal(found.phase, self.phase) or not self.run.changes:
            self.run.changes.append((t, found.phase))
        self.phase = found.phase
        speed = np.linalg.norm(velocities, axis=1)
        self.frozen = self.phase.slipping & (speed < FROZEN_BELOW)
        return True

    def _advance(self, t: float, end: float) -> bool:
        """One period under held torques, through the events inside it."""
        while end - t > 1e-12:
            t, fired = self._stretch(t, end)
            if fired is None:
                continue
            if isinstance(fired, str):
                self.run.outcome, self.run.end_time = fired, t
                return False
            if not self._select(t, fired):
                return False
        return True

    def _stretch(self, t: float, end: float) -> tuple[float, NDArray[np.bool_] | str | None]:
        """Integrates to the end or to an event; which contacts left their cone there, or None."""
        slips = bool(self.phase.slipping.any())
        if self.frozen.any():
            acceleration = self._plant(self.z, self.phase)[0][6:].reshape(-1, 2)[self.frozen]
            least = np.linalg.norm(acceleration, axis=1).min()
            end = min(end, t + (1e-6 if least > 0.1 else 2e-5))
        stepper = self._stepper(self.z, end - t, 1e-5 if slips else 1e-3)
        while stepper.status == "running":
            begun, start = t + stepper.t, stepper.y.copy()
            stepper.max_step = self._longest_step(start)
            stepper.step()
            if self._guards(stepper.y, start).least() < 0.0:
                at, guards = self._locate(start, t + stepper.t - begun)
                return begun + at, self._event(guards)
            self.z = stepper.y.copy()
            self._normalise()
        assert stepper.status == "finished"
        self._unfreeze()
        return end, None

    def _stepper(self, z: Array, span: float, first_step: float) -> DOP853 | Radau:
        """Radau while anything slips: the direction of slip is stiff."""
        limits = {"rtol": self.world.tolerance, "atol": 1e-12, "first_step": min(first_step, span)}
        if self.phase.slipping.any():
            return Radau(self._flow(), 0.0, z, span, jac=self._stiff_jacobian, **limits)
        return DOP853(self._flow(), 0.0, z, span, **limits)

    def _stiff_jacobian(self, t: float, z: Array) -> Array:
        """The columns of the slip velocities whose direction turns, by differences; else zero.

        It decides how fast Newton's method converges, and not to what.
        """
        flow, slip = self._flow(), slice(13 + 2 * self.n, 13 + 4 * self.n)
        jacobian = np.zeros((len(z), len(z)))
        if self.world.law.friction == "pyramid":
            return jacobian
        here = flow(t, z)
        speeds = np.linalg.norm(z[slip].reshape(-1, 2), axis=1)
        steps = np.repeat(1e-6 * np.maximum(speeds, STOP_SPEED), 2)
        for k in np.flatnonzero(np.repeat(self.phase.slipping & ~self.frozen, 2)):
            ahead = z.copy()
            ahead[slip.start + k] += steps[k]
            jacobian[:, slip.start + k] = (flow(t, ahead) - here) / steps[k]
        return jacobian

    def _flow(self):
        phase, frozen = self.phase, self.frozen

        def flow(t: float, z: Array) -> Array:
            return self._derivative(z, phase, frozen)

        return flow

    def _derivative(self, z: Array, phase: Phase, frozen: NDArray[np.bool_]) -> Array:
        state = _state(z, self.n)
        kin = self.world.hand.kinematics(state)
        phase = self._turned(phase, frozen, state.slip_velocity)
        acceleration, forces = self._solve(kin, state, phase)
        slip = np.where(phase.sticks, 0.0, acceleration[6:].reshape(-1, 2))
        lost = -np.sum(forces[:, :2] * state.slip_velocity)
        return np.concatenate(
            (
                state.velocity[:3],
                quaternion_rate(state.quaternion, state.velocity[3:]),
                acceleration[:6],
                state.slip_velocity.ravel(),
                slip.ravel(),
                [np.sum(self.torques * kin.qd), lost],
                np.linalg.norm(state.slip_velocity, axis=1),
            )
        )

    def _turned(self, phase: Phase, frozen: NDArray[np.bool_], velocity: Array) -> Phase:
        """The cone's directions follow the slip, unless they are kept."""
        if self.world.law.friction == "pyramid":
            return phase
        follows = (phase.slipping & ~frozen)[:, None]
        speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), STOP_SPEED)
        return phase._replace(directions=np.where(follows, velocity / speed, phase.directions))

    def _solve(self, kin: Kinematics, state: State, phase: Phase) -> tuple[Array, Array]:
        self.run.evaluations += 1
        truth = self.world.truth
        reduced = self.world.hand.reduced_form(kin, truth, phase, state.velocity[3:])
        acceleration = np.linalg.solve(reduced.M, reduced.B @ self.torques.ravel() - reduced.h)
        return acceleration, contact_forces(kin, truth, self.torques, acceleration)

    def _plant(self, z: Array, phase: Phase) -> tuple[Array, Array]:
        """Acceleration and contact forces in the present phase."""
        state = _state(z, self.n)
        phase = self._turned(phase, self.frozen, state.slip_velocity)
        return self._solve(self.world.hand.kinematics(state), state, phase)

    def _speed_guards(self, z: Array) -> Array:
        """What falls through zero where a slip ends, per contact and tangent, ``(n, 2)``."""
        velocity = _state(z, self.n).slip_velocity
        forward = self.phase.directions * velocity
        if self.world.law.friction == "pyramid":
            return np.where(self.phase.sticks, 1.0, np.where(self.frozen[:, None], 1.0, forward))
        speed = np.linalg.norm(velocity, axis=1)
        along = np.where(self.frozen, forward.sum(axis=1) + 1e-9, speed - STOP_SPEED)
        return np.repeat(np.where(self.phase.slipping, along, 1.0)[:, None], 2, axis=1)

    def _guards(self, z: Array, start: Array) -> Guards:
        """All guards after a step from ``start``."""
        _, forces = self._plant(z, self.phase)
        spare = margins(forces, self.world.truth.friction, self.world.law.friction)
        spare = np.where(self.phase.sticks, spare / (1.0 + forces[:, 2:]) + ON_CONE, 1.0)
        ends = self._speed_guards(z)
        if self.world.law.friction == "cone":
            before, after = _state(start, self.n).slip_velocity, _state(z, self.n).slip_velocity
            turned = self.phase.slipping & ~self.frozen & (np.sum(before * after, axis=1) <= 0.0)
            ends = np.where(turned[:, None], -1.0, ends)
        return Guards(spare, ends, forces[:, 2])

    def _locate(self, start: Array, step: float) -> tuple[float, Guards]:
        """Moves to the first instant of a step at which a guard is zero; says when."""

        def least(dt: float) -> float:
            return self._guards(self._single(start, dt), start).least()

        early = 1e-14
        dt = float(brentq(least, early, step, xtol=1e-14)) if least(early) > 0.0 else early
        self.z = self._single(start, dt)
        guards = self._guards(self.z, start)
        self._normalise()
        return dt, guards

    def _single(self, start: Array, span: float) -> Array:
        """From a state over part of a step."""
        stepper = self._stepper(start, span, span)
        while stepper.status == "running":
            stepper.step()
        assert stepper.status == "finished"
        return stepper.y.copy()

    def _event(self, guards: Guards) -> NDArray[np.bool_] | str:
        """What happened: rests what stops; the contacts that left their cone, or an outcome."""
        if np.any(guards.normal <= FIRED):
            return "separated"
        stops = guards.ends < FIRED
        velocity = self.z[13 + 2 * self.n : 13 + 4 * self.n].reshape(self.n, 2)
        if self.world.law.friction == "cone" and stops.any():
            acceleration = self._plant(self.z, self.phase)[0][6:].reshape(-1, 2)
            slowing = -np.sum(velocity * acceleration, axis=1)
            speed = np.linalg.norm(velocity, axis=1)
            soon = self.phase.slipping & (speed < TOGETHER_SPEED) & (slowing > 0.0)
            stops |= (soon & (speed**2 < STOPS_TOGETHER * slowing))[:, None]
        velocity[stops] = 0.0
        self.frozen &= ~stops.any(axis=1)
        return self.phase.sticks & (guards.spare < FIRED)

    def _normalise(self) -> None:
        self.z[3:7] /= np.linalg.norm(self.z[3:7])

    def _unfreeze(self) -> None:
        """Directions follow the slip once it is fast enough."""
        velocity = _state(self.z, self.n).slip_velocity
        if self.world.law.friction == "pyramid":
            moves = (self.phase.directions * velocity > 0.0) | self.phase.sticks
            self.frozen &= ~moves.all(axis=1)
        else:
            self.frozen &= np.linalg.norm(velocity, axis=1) < FROZEN_BELOW

    def _longest_step(self, z: Array) -> float:
        """Less than the time in which the slowest contact would stop."""
        slips = self.phase.slipping & ~self.frozen
        if not slips.any():
            return np.inf
        state = _state(z, self.n)
        acceleration = self._plant(z, self.phase)[0][6:].reshape(-1, 2)
        speed = np.linalg.norm(state.slip_velocity, axis=1)[slips]
        slowing = -np.sum(state.slip_velocity * acceleration, axis=1)[slips] / np.maximum(
            speed, 1e-12
        )
        limits = np.where(slowing > 0.0, 0.6 * speed / np.maximum(slowing, 1e-12), np.inf)
        return max(float(limits.min()), 1e-9)


def _equal(a: Phase, b: Phase) -> bool:
    return bool(np.array_equal(a.sticks, b.sticks))


def _pack(state: State, rest: Array) -> Array:
    return np.concatenate([np.ravel(part) for part in (*state, rest)])


def _state(z: Array, n: int) -> State:
    return State(
        z[:3], z[3:7], z[7:13], z[13 : 13 + 2 * n].reshape(n, 2),
        z[13 + 2 * n : 13 + 4 * n].reshape(n, 2),
    )  # fmt: skip
