"""Which contacts stick and which way the others slip, from the frictional contact problem.

w = G F + c with w = (s_x'', s_y'', separation) per contact. Friction laws are `CONE`, where a
contact has one phase, and `PYRAMID`, where it has one along every tangent.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import compress, product
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.spatial_plant import Flags, Phase

Array = NDArray[np.float64]
Friction = Literal["cone", "pyramid"]

REST_SPEED = 3.1e-9  # slip speed [m]/[s] below which a contact may change its phase
FORCE_BAND = 1e-9  # relative distance from the cone within which it still sticks
ACCELERATION_BAND = 1e-7  # slip acceleration [m]/[s^2] that counts as none
RESTARTS = 8


class Problem(NamedTuple):
    """The contact problem of one instant.

    Attributes:
        G: ``(3n, 3n)``.
        c: ``(3n,)``.
        mu: Friction, ``(n,)``.
        moving: Where slip goes on along a known direction, ``(n, 2)``.
        directions: gamma of Eq. 7 there, ``(n, 2)``.
        leaving: Where the boundary was reached from inside, ``(n, 2)``.
        friction: Cone or pyramid.
        bounds: Friction that a contact (or tangent) at rest has at most, ``(n, 2)``; None: mu.
    """

    G: Array
    c: Array
    mu: Array
    moving: Flags
    directions: Array
    leaving: Flags
    friction: Friction = "cone"
    bounds: Array | None = None

    @property
    def most(self) -> Array:
        """The largest friction of each contact (or tangent), ``(n, 2)``."""
        usual = np.repeat(self.mu[:, None], 2, axis=1)
        return usual if self.bounds is None else np.where(self.moving, usual, self.bounds)


class Selection(NamedTuple):
    """Phases with their forces, ``(n, 3)``, and w, ``(n, 3)``; phase None where none agrees."""

    phase: Phase | None
    forces: Array
    relative: Array


def moving_directions(slip_velocity: Array, friction: Friction) -> tuple[Flags, Array]:
    """Which contacts (or tangents) slip, and gamma there."""
    if friction == "pyramid":
        moving = np.abs(slip_velocity) >= REST_SPEED
        return moving, np.where(moving, np.sign(slip_velocity), 0.0)
    speed = np.linalg.norm(slip_velocity, axis=1, keepdims=True)
    moving = np.broadcast_to(speed >= REST_SPEED, slip_velocity.shape)
    return moving, np.where(moving, slip_velocity / np.where(moving, speed, 1.0), 0.0)


def select(problem: Problem, seed: int = 0) -> Selection:
    """The first of `answers`, or the last candidate without a phase."""
    last = None
    for last in candidates(problem, seed):
        if last.phase is not None:
            break
    assert last is not None, "there is at least one choice of frictions"
    return last


def answers(problem: Problem, seed: int = 0) -> Iterator[Selection]:
    """Phases that agree with the forces they give."""
    return (found for found in candidates(problem, seed) if found.phase is not None)


def candidates(problem: Problem, seed: int) -> Iterator[Selection]:
    """All free contacts stick if they may, then what Newton's method finds; some without a phase.

    Where more friction holds a contact than it has in slip, it is tried with either: with the
    greater one it must stick.
    """
    sticking = _stuck(problem)
    forces = forces_in(problem, sticking)
    if np.all(forces[:, 2] > 0.0) and not problem.leaving.any() and _may_stick(problem, forces):
        yield Selection(sticking, forces, relative_motion(problem, forces))
    for chosen in _choices(problem):
        yield _solve(chosen, forces, seed)


def _stuck(problem: Problem) -> Phase:
    return Phase(~problem.moving, np.where(problem.moving, problem.directions, 0.0))


def _choices(problem: Problem) -> Iterator[Problem]:
    """The problem with each of the frictions that contacts at rest may have."""
    slip = np.repeat(problem.mu[:, None], 2, axis=1)
    more = np.argwhere(problem.most > slip).tolist()
    groups = [[(i, k)] for i, k in more]
    if problem.friction == "cone":
        groups = [[(i, 0), (i, 1)] for i, k in more if k == 0]
    for loose in product((False, True), repeat=len(groups)):
        bounds = problem.most.copy()
        for i, k in (place for group in compress(groups, loose) for place in group):
            bounds[i, k] = slip[i, k]
        yield problem._replace(bounds=bounds)


def _solve(problem: Problem, forces: Array, seed: int) -> Selection:
    """The solution of Newton's method; its phase if contacts push and greater friction holds."""
    solutions = (solve_by_newton(problem, start) for start in _starts(forces, seed))
    solution = next((found for found in solutions if found is not None), None)
    if solution is None:
        return Selection(None, forces, relative_motion(problem, forces))
    w = relative_motion(problem, solution)
    phase = _read_phase(problem, solution, w)
    held = problem.most > problem.mu[:, None]
    agrees = np.all(solution[:, 2] > 0.0) and phase.sticks[held].all()
    return Selection(phase if agrees else None, solution, w)


def forces_in(problem: Problem, phase: Phase) -> Array:
    """Forces in given phases, with contacts kept closed, ``(n, 3)``."""
    rows, right = equations_in(problem, phase)
    return np.linalg.solve(rows, right).reshape(len(problem.mu), 3)


def equations_in(problem: Problem, phase: Phase) -> tuple[Array, Array]:
    """The equations of these forces, ``(3n, 3n)`` and ``(3n,)``."""
    rows, right = problem.G.copy(), -problem.c.copy()
    for i, k in zip(*np.nonzero(~phase.sticks), strict=True):
        rows[3 * i + k] = 0.0
        rows[3 * i + k, 3 * i + k] = 1.0
        rows[3 * i + k, 3 * i + 2] = problem.mu[i] * phase.directions[i, k]
        right[3 * i + k] = 0.0
    return rows, right


def relative_motion(problem: Problem, forces: Array) -> Array:
    """w of all contacts, ``(n, 3)``."""
    return (problem.G @ forces.ravel() + problem.c).reshape(forces.shape)


def margins(forces: Array, mu: Array, friction: Friction) -> Array:
    """Distance from the friction bound, per contact and tangent, ``(n, 2)`` [N].

    ``mu`` is ``(n,)`` or ``(n, 2)``.
    """
    bound = np.broadcast_to(mu.reshape(len(forces), -1), (len(forces), 2)) * forces[:, 2:]
    if friction == "pyramid":
        return bound - np.abs(forces[:, :2])
    return bound - np.linalg.norm(forces[:, :2], axis=1, keepdims=True)


def solve_by_newton(problem: Problem, start: Array) -> Array | None:
    """Forces of the contact problem by a semi-smooth Newton method, ``(n, 3)``."""
    F = start.ravel().copy()
    for iteration in range(100):
        residual, slope = _residual(problem, F)
        if np.max(np.abs(residual)) <= 1e-12 * (1.0 + np.max(np.abs(F))):
            return F.reshape(start.shape)
        try:
            step = np.linalg.solve(slope, residual)
        except np.linalg.LinAlgError:
            return None
        F = F - (step if iteration < 30 else 0.5 * step)
        if not np.all(np.isfinite(F)):
            return None
    return None


def _residual(problem: Problem, F: Array) -> tuple[Array, Array]:
    """What vanishes at a solution, and its generalised Jacobian."""
    G, mu, most = problem.G, problem.mu, problem.most
    w, size = G @ F + problem.c, len(F)
    residual, slope = np.empty(size), np.zeros((size, size))
    for i, coefficient in enumerate(mu):
        t, normal = [3 * i, 3 * i + 1], 3 * i + 2
        residual[normal], slope[normal] = w[normal], G[normal]
        free = [a for k, a in enumerate(t) if not problem.moving[i, k]]
        for k, a in enumerate(t):
            if problem.moving[i, k]:
                gamma = problem.directions[i, k]
                residual[a] = F[a] + coefficient * gamma * F[normal]
                slope[a, a], slope[a, normal] = 1.0, coefficient * gamma
        groups = [[a] for a in free] if problem.friction == "pyramid" else [free] * bool(free)
        for group in groups:
            bound = most[i, group[0] - 3 * i]
            radius = bound * max(F[normal], 0.0)
            rising = bound if F[normal] > 0.0 else 0.0
            rho = 1.0 / max(G[a, a] for a in group)
            pull = F[group] - rho * w[group]
            length = float(np.linalg.norm(pull))
            pull_slope = np.eye(size)[group] - rho * G[group]
            if length <= radius:
                residual[group], slope[group] = rho * w[group], rho * G[group]
                continue
            along = pull / length
            turning = radius / length * (np.eye(len(group)) - np.outer(along, along))
            residual[group] = F[group] - radius * along
            slope[group] = np.eye(size)[group] - turning @ pull_slope
            slope[group, normal] -= rising * along
    return residual, slope


def _starts(forces: Array, seed: int) -> Iterator[Array]:
    yield forces
    rng = np.random.default_rng(seed)
    for _ in range(RESTARTS):
        scale = 1.0 + np.abs(forces).max()
        start = scale * rng.normal(size=forces.shape)
        start[:, 2] = np.abs(start[:, 2])
        yield start


def _may_stick(problem: Problem, forces: Array) -> bool:
    spare = margins(forces, problem.most, problem.friction)
    enough = spare >= -FORCE_BAND * (1.0 + forces[:, 2:])
    return bool(np.all(enough | problem.moving))


def _read_phase(problem: Problem, forces: Array, w: Array) -> Phase:
    """Phases of a solution: what accelerates slips that way, what leaves its cone along -F_t."""
    gamma = np.where(problem.moving, problem.directions, 0.0)
    pulls = -forces[:, :2]
    if problem.friction == "pyramid":
        speeds, tangential = np.abs(w[:, :2]), np.sign(w[:, :2])
        onset = np.sign(pulls)
    else:
        speeds = np.repeat(np.linalg.norm(w[:, :2], axis=1, keepdims=True), 2, axis=1)
        tangential = w[:, :2] / np.where(speeds > 0.0, speeds, 1.0)
        lengths = np.linalg.norm(pulls, axis=1, keepdims=True)
        onset = pulls / np.where(lengths > 0.0, lengths, 1.0)
    starts = ~problem.moving & (speeds > ACCELERATION_BAND)
    leaves = ~problem.moving & ~starts & problem.leaving
    gamma = np.where(starts, tangential, np.where(leaves, onset, gamma))
    return Phase(~(problem.moving | starts | leaves), gamma)
