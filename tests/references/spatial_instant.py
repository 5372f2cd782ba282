"""The last instant of a run in space: whether some phases of closed contacts agree there."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, islice, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial import SpatialScenario
from tests.references.changes import scenario_at
from tests.references.spatial_contact import (
    Problem,
    Selection,
    candidates,
    equations_in,
    margins,
    moving_directions,
)
from tests.references.spatial_plant import Parameters, Phase, State
from tests.references.spatial_scenarios import hand_of_scenario

Array = NDArray[np.float64]

# By which an answer must agree, so that it is no matter of rounding [N], and share of the forces.
SURELY, SURE_SHARE = 1e-6, 1e-12
SEARCHES = 10
MOST_TRIED = 20  # choices of frictions, each from several starts
MOST_ENUMERATED = 4  # fingers
SINGULAR = 1e14  # condition number
ON_RIM = 1e-11  # [m]; fingertips that come this close to a rim together slide over it together


def find_closed_answer(run: RunResult, torques: Array) -> Phase | None:
    """Phases in which every contact pushes, beyond doubt, where a run ends; None if none is found.

    In the pyramid all combinations are tried for up to four fingers; on the cone, and for more
    fingers, Newton's method searches from many starts. Where even forces that only need to lie
    within their pyramids could not keep all contacts closed, there is nothing to look for.

    Args:
        run: The run.
        torques: That act at its end, ``(n, 3)`` [N m].
    """
    problem = problem_at_end(run, torques)
    if not _can_keep_closed(problem):
        return None
    if problem.friction == "pyramid" and len(problem.mu) <= MOST_ENUMERATED:
        return _enumerate(problem)
    tried = chain.from_iterable(candidates(problem, seed) for seed in range(SEARCHES))
    for found in islice(tried, MOST_TRIED):
        if found.phase is not None and _is_sure(problem, found.phase, found):
            return found.phase
    return None


def _is_sure(problem: Problem, phase: Phase, found: Selection) -> bool:
    """Whether contacts push, stick inside their bounds and begin to slip their way, beyond doubt.

    A contact on the bound of its static friction is about to leave it.
    """
    sure = SURELY + SURE_SHARE * float(np.abs(found.forces).max())
    spare = margins(found.forces, problem.most, problem.friction)
    along = phase.directions * found.relative[:, :2]
    if problem.friction == "cone":
        along = along.sum(axis=1, keepdims=True)
    fits = problem.moving | np.where(phase.sticks, spare > sure, along > SURELY)
    return bool(found.forces[:, 2].min() > sure and fits.all())


def _can_keep_closed(problem: Problem) -> bool:
    """Whether forces within the pyramids around the cones let no contact open or close.

    Every answer is such a point of a linear program, whose other points do not tell stick from
    slip.
    """
    n = len(problem.mu)
    normals = 3 * np.arange(n) + 2
    fixed, bounded = [problem.G[normals]], []
    for i, k in product(range(n), range(2)):
        row = np.zeros(3 * n)
        row[3 * i + k] = 1.0
        if problem.moving[i, k]:
            row[3 * i + 2] = problem.mu[i] * problem.directions[i, k]
            fixed.append(row[None])
        else:
            row[3 * i + 2] = -problem.most[i, k]
            bounded += [row, np.where(np.arange(3 * n) == 3 * i + k, -1.0, row)]
    equal = np.vstack(fixed)
    right = np.concatenate((-problem.c[normals], np.zeros(len(equal) - n)))
    limits = [(0.0, None) if place % 3 == 2 else (None, None) for place in range(3 * n)]
    found = linprog(
        np.zeros(3 * n),
        A_ub=np.array(bounded).reshape(-1, 3 * n),
        b_ub=np.zeros(len(bounded)),
        A_eq=equal,
        b_eq=right,
        bounds=limits,
    )
    return found.status != 2  # infeasible


def problem_at_end(run: RunResult, torques: Array) -> Problem:
    """The contact problem of the last instant."""
    last, scenario = run.trace[-1:], scenario_at(run.scenario, run.end_time)
    assert isinstance(scenario, SpatialScenario)
    n = len(scenario.fingers)
    slip, slides = last.slip[0].reshape(n, 2), last.slip_velocity[0].reshape(n, 2)
    factors = np.array([factor_at(scenario, i, slip[i], slides[i], run.end_time) for i in range(n)])
    truth = Parameters(
        np.array([finger.link_masses for finger in scenario.fingers]),
        scenario.object.mass,
        np.array(scenario.object.inertias),
        np.array([f.friction for f in scenario.fingers]) * factors,
    )
    static = np.array([f.static_friction or f.friction for f in scenario.fingers]) * factors
    pose, friction = last.object_pose[0], scenario.simulation.friction
    moving, directions = moving_directions(slides, friction)
    velocity = np.where(moving, slides, 0.0)
    state = State(pose[:3], pose[3:], last.object_velocity[0], slip, velocity)
    hand = hand_of_scenario(scenario)
    kin = hand.kinematics(state)
    given = torques - _joint_friction(scenario, kin.qd)
    G, c = hand.contact_space(kin, state, truth, given, _load(scenario, run.end_time))
    none = np.zeros((n, 2), bool)
    bounds = np.repeat(static[:, None], 2, axis=1)
    return Problem(G, c, truth.friction, moving, directions, none, friction, bounds)


def factor_at(scenario: SpatialScenario, i: int, slip: Array, velocity: Array, t: float) -> float:
    """What the friction of a fingertip is multiplied by where it is, on patches or beside them.

    On the rim of a patch, where a run ends that could not slide over it, the side that it slides
    onto counts.
    """
    finger, here = scenario.fingers[i], slip + scenario.fingers[i].contact_offset
    factor = 1.0
    for patch in scenario.patches:
        is_there = patch.start_time <= t < (np.inf if patch.end_time is None else patch.end_time)
        away = here - patch.centre
        depth = patch.radius - float(np.linalg.norm(away))
        inward = depth if abs(depth) > ON_RIM else -float(away @ velocity)
        if patch.face == finger.face and is_there and inward > 0.0:
            factor *= patch.friction_factor
    return factor


def force_rounding(run: RunResult, row: int, directions: Array) -> float:
    """How far rounding of the state may change the forces in a row [N].

    The condition number of their equations times the precision of numbers and the largest force:
    it grows without bound where det M~ tends to 0.

    Args:
        run: The run.
        row: Of its trace.
        directions: gamma of Eq. 7 there, ``(n, 2)``; 0 in stick.
    """
    until = replace(run, trace=run.trace[: row + 1])
    problem = problem_at_end(until, np.zeros((len(directions), 3)))
    rows, _ = equations_in(problem, Phase(directions == 0.0, directions))
    trace = until.trace[-1:]
    largest = max(np.abs(trace.normal_force).max(), np.abs(trace.tangential_force).max())
    return float(np.linalg.cond(rows) * np.finfo(float).eps * largest)


def _load(scenario: SpatialScenario, t: float) -> Array:
    """Force and moment of the pulses that act from a time on, ``(6,)``."""
    acting = [p for p in scenario.pulses if p.time <= t < p.time + p.duration]
    return sum((np.array([*p.force, *p.moment]) for p in acting), np.zeros(6))


def _joint_friction(scenario: SpatialScenario, rates: Array) -> Array:
    """Torques that the friction of the joints takes, ``(n, 3)`` [N m]."""
    damping = np.array([finger.joint_damping for finger in scenario.fingers])[:, None]
    dry = np.array([finger.joint_friction for finger in scenario.fingers])[:, None]
    return damping * rates + dry * rates / np.hypot(rates, 0.01)


def _enumerate(problem: Problem) -> Phase | None:
    """The first of all combinations that agrees beyond doubt."""
    free = ~problem.moving
    signs = np.array(list(product((0.0, 1.0, -1.0), repeat=int(free.sum()))))
    directions = np.repeat(problem.directions[None], len(signs), axis=0)
    directions[:, free] = signs
    forces, regular = _forces_in_all(problem, directions)
    motion = forces.reshape(len(signs), -1) @ problem.G.T + problem.c
    along = directions * motion.reshape(forces.shape)[:, :, :2]
    spare = problem.most * forces[:, :, 2:] - np.abs(forces[:, :, :2])
    sure = (SURELY + SURE_SHARE * np.abs(forces).max(axis=(1, 2)))[:, None, None]
    fits = problem.moving | np.where(directions == 0.0, spare > sure, along > SURELY)
    pushes = forces[:, :, 2].min(axis=1) > sure[:, 0, 0]
    agree = np.flatnonzero(regular & pushes & fits.all(axis=(1, 2)))
    return Phase(directions[agree[0]] == 0.0, directions[agree[0]]) if len(agree) else None


def _forces_in_all(problem: Problem, directions: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Forces in many phases of the pyramid, and which phases have any.

    As `tests.references.spatial_contact.forces_in` of one.
    """
    count, n = len(directions), len(problem.mu)
    rows = np.repeat(problem.G[None], count, axis=0)
    right = np.repeat(-problem.c[None], count, axis=0)
    for i, k in product(range(n), range(2)):
        slips, place = directions[:, i, k] != 0.0, 3 * i + k
        rows[slips, place] = 0.0
        rows[slips, place, place] = 1.0
        rows[slips, place, 3 * i + 2] = problem.mu[i] * directions[slips, i, k]
        right[slips, place] = 0.0
    regular = np.linalg.cond(rows) < SINGULAR
    rows[~regular] = np.eye(3 * n)
    return np.linalg.solve(rows, right[:, :, None]).reshape(count, n, 3), regular
