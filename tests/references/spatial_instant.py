"""The last instant of a run in space: whether some phases of closed contacts agree there."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.spatial import SpatialScenario
from tests.references.spatial_contact import (
    Problem,
    answers,
    forces_in,
    margins,
    moving_directions,
    relative_motion,
)
from tests.references.spatial_plant import Parameters, Phase, State
from tests.references.spatial_scenarios import hand_of_scenario

Array = NDArray[np.float64]

# By which an answer must agree, so that it is no matter of rounding [N], and share of the forces.
SURELY, SURE_SHARE = 1e-6, 1e-12
SEARCHES = 10


def find_closed_answer(run: RunResult, torques: Array) -> Phase | None:
    """Phases in which every contact pushes, beyond doubt, where a run ends; None if there are none.

    In the pyramid all combinations are tried, on the cone Newton's method from many starts.

    Args:
        run: The run.
        torques: That act at its end, ``(n, 3)`` [N m].
    """
    problem = problem_at_end(run, torques)
    if problem.friction == "pyramid":
        return _enumerate(problem)
    for seed in range(SEARCHES):
        for found in answers(problem, seed):
            if found.forces[:, 2].min() > _surely(found.forces):
                return found.phase
    return None


def problem_at_end(run: RunResult, torques: Array) -> Problem:
    """The contact problem of the last instant."""
    last, scenario = run.trace[-1:], run.scenario
    for change in sorted(scenario.changes, key=lambda change: change.time):
        if change.time <= run.end_time:
            scenario = with_values(scenario, {change.parameter: change.value})
    assert isinstance(scenario, SpatialScenario)
    n = len(scenario.fingers)
    slip = last.slip[0].reshape(n, 2)
    factors = np.array([_factor_at(scenario, i, slip[i], run.end_time) for i in range(n)])
    truth = Parameters(
        np.array([finger.link_masses for finger in scenario.fingers]),
        scenario.object.mass,
        np.array(scenario.object.inertias),
        np.array([f.friction for f in scenario.fingers]) * factors,
    )
    static = np.array([f.static_friction or f.friction for f in scenario.fingers]) * factors
    pose, friction = last.object_pose[0], scenario.simulation.friction
    moving, directions = moving_directions(last.slip_velocity[0].reshape(n, 2), friction)
    velocity = np.where(moving, last.slip_velocity[0].reshape(n, 2), 0.0)
    state = State(pose[:3], pose[3:], last.object_velocity[0], slip, velocity)
    hand = hand_of_scenario(scenario)
    kin = hand.kinematics(state)
    G, c = hand.contact_space(kin, state, truth, torques, _load(scenario, run.end_time))
    none = np.zeros((n, 2), bool)
    bounds = np.repeat(static[:, None], 2, axis=1)
    return Problem(G, c, truth.friction, moving, directions, none, friction, bounds)


def _factor_at(scenario: SpatialScenario, i: int, slip: Array, t: float) -> float:
    """What the friction of a fingertip is multiplied by where it is, on patches or beside them."""
    finger, here = scenario.fingers[i], slip + scenario.fingers[i].contact_offset
    factor = 1.0
    for patch in scenario.patches:
        is_there = patch.start_time <= t < (np.inf if patch.end_time is None else patch.end_time)
        is_inside = np.linalg.norm(here - patch.centre) < patch.radius
        if patch.face == finger.face and is_there and is_inside:
            factor *= patch.friction_factor
    return factor


def _load(scenario: SpatialScenario, t: float) -> Array:
    """Force and moment of the pulses that act from a time on, ``(6,)``."""
    acting = [p for p in scenario.pulses if p.time <= t < p.time + p.duration]
    return sum((np.array([*p.force, *p.moment]) for p in acting), np.zeros(6))


def _enumerate(problem: Problem) -> Phase | None:
    free = np.argwhere(~problem.moving)
    for signs in product((0.0, 1.0, -1.0), repeat=len(free)):
        directions = np.where(problem.moving, problem.directions, 0.0)
        directions[tuple(free.T)] = signs
        phase = Phase(directions == 0.0, directions)
        if _agrees(problem, phase):
            return phase
    return None


def _agrees(problem: Problem, phase: Phase) -> bool:
    """Whether contacts push, what sticks is inside its pyramid, and what begins slips its way."""
    forces = forces_in(problem, phase)
    spare = margins(forces, problem.most, "pyramid")
    along = phase.directions * relative_motion(problem, forces)[:, :2]
    sure = _surely(forces)
    fits = np.where(problem.moving, True, np.where(phase.sticks, spare > sure, along > SURELY))
    return bool(forces[:, 2].min() > sure and fits.all())


def _surely(forces: Array) -> float:
    return SURELY + SURE_SHARE * float(np.abs(forces).max())
