"""Checks that random spatial hands end correctly, with every force inside its cone or pyramid.

Runs are drawn so that every pair of levels of all settings occurs. They are checked by their traces
and, for half of them, by the same runs with a finer output; if no phases are consistent, or a
contact can only open under a new torque, an independent search is made
(`tests.references.spatial_instant`, of soft fingertips `tests.references.soft_instant`).
"""

from __future__ import annotations

import numpy as np

from benchmarks import outcome_checks
from benchmarks.outcome_checks import (
    OUTSIDE_CONE,
    Check,
    Judge,
    Pair,
    common_missed,
    ledger_error,
)
from benchmarks.outcomes import SEED, judge_many, tabulate
from benchmarks.random_runs import PAIRS_IN_SPACE
from benchmarks.report import Table
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.types import Outcome
from tests.references import soft_instant, spatial_instant
from tests.references.changes import scenario_at
from tests.references.spatial_instant import force_rounding

COUNT = 10_000
LEDGER_SHARE = 1e-8  # of the largest energy of the run: the relative tolerance of the steps
SAME_VELOCITY = 1e-7  # of 1 m/s and the velocity; slips below that may end together


def run(seed: int = SEED) -> list[Table]:
    """The tables ``hands-in-space`` and ``hands-in-space-endings``."""
    return tabulate([judge_many(PAIRS_IN_SPACE, COUNT, seed, JUDGE)], "hands-in-space")


def measure_in_space(pair: Pair) -> dict[str, float]:
    """Deviation of each check by name: `outcome_checks.Judge.measure`."""
    return common_missed(pair, SAME_VELOCITY) | {
        "cone": max(map(_outside_friction, pair.runs)),
        "ledger": max(ledger_error(run.trace, LEDGER_SHARE) for run in pair.runs),
        **_untrue_ends(pair.plain, pair.held),
    }


def _outside_friction(run: RunResult) -> float:
    """The largest excess over cone, pyramid or limit surface, or distance in slip, relative.

    The rows are those that `benchmarks.outcome_checks` uses for planar hands. Changes of a force
    within the rounding of the state are no excess.
    """
    trace, scenario = run.trace, run.scenario
    assert isinstance(scenario, SpatialScenario)
    rows = np.arange(len(trace)) > 0
    if run.outcome.ended_by_physics:
        rows &= trace.times < run.end_time
    forces = friction_of(run)[rows]
    phases = trace.phase[rows].astype(float)
    normal = trace.normal_force[rows]
    bound = (trace.friction_coefficient[rows] * normal)[:, :, None]
    directions = _directions(run, phases, rows)
    against = -bound * directions
    slips = (phases != 0.0)[:, :, None]
    if scenario.friction_cone == "pyramid":
        # During slip along one tangent, the other one sticks with static friction.
        ratios = np.where(slips, _static_over_kinetic(run)[rows][:, :, None], 1.0)
        known = np.isfinite(ratios)  # without sliding friction the trace lacks the static one
        most = np.where(known, bound * np.where(known, ratios, 1.0), np.inf)
        slips = against != 0.0
        excess = np.where(slips, np.abs(forces - against), np.abs(forces) - most)
    else:
        size = np.linalg.norm(forces, axis=2, keepdims=True)
        off = np.linalg.norm(forces - against, axis=2, keepdims=True)
        excess = np.where(slips, off, size - bound)
    scale = (1.0 + np.linalg.norm(forces, axis=2) + np.abs(normal))[:, :, None]
    soft = eccentricities(scenario).any()
    for k in np.flatnonzero((excess > OUTSIDE_CONE * scale).any(axis=(1, 2)) & ~soft):
        gamma = np.where((phases[k] != 0.0)[:, None], directions[k], 0.0)
        excess[k] -= force_rounding(run, int(np.flatnonzero(rows)[k]), gamma)
    worst = float((excess / scale).max(initial=0.0))
    return worst if worst > OUTSIDE_CONE else 0.0


def _static_over_kinetic(run: RunResult) -> np.ndarray:
    """Ratio of static to sliding friction of each contact at every row, ``(rows, n)``."""
    times, scenario = run.trace.times, run.scenario
    ratios = np.ones((len(times), len(scenario.fingers)))
    for time in sorted({0.0, *(change.time for change in scenario.changes)}):
        fingers = scenario_at(scenario, time).fingers
        kinetic = np.array([finger.friction for finger in fingers])
        static = np.array([finger.static_friction or finger.friction for finger in fingers])
        after = np.divide(static, kinetic, out=np.full(len(fingers), np.inf), where=kinetic > 0.0)
        # Either of the two rows of an instant may be the previous one.
        ratios[times == time] = np.maximum(ratios[times == time], after)
        ratios[times > time] = after
    return ratios


def _directions(run: RunResult, phases: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Slip directions, ``(rows, n, 2)``: by phase, or by slip velocity if there is one.

    On the cone a slip that has just begun keeps its initial direction for some time; the direction
    of the force is used for it, so that only its magnitude is checked. The same applies to soft
    fingertips.
    """
    if run.scenario.simulation.friction == "pyramid":
        signs = np.where(phases == 0.0, 0.0, phases - 7.0)
        first = np.round(signs / 3.0)
        return np.stack([first, signs - 3.0 * first], axis=2)
    velocity, force = slide_of(run)[rows], friction_of(run)[rows]
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    pull = -force / np.maximum(np.linalg.norm(force, axis=2, keepdims=True), 1e-300)
    if eccentricities(run.scenario).any():
        return pull
    return np.where(speed >= SURE_SPEED, velocity / np.maximum(speed, SURE_SPEED), pull)


SURE_SPEED = 1e-7  # [m/s]


def eccentricities(scenario: Scenario) -> np.ndarray:
    """Ratio of largest moment to largest tangential force of contacts, 0 for points, ``(n,)``."""
    assert isinstance(scenario, SpatialScenario)
    return np.array([finger.eccentricity for finger in scenario.fingers])


def friction_of(run: RunResult) -> np.ndarray:
    """(F_x, F_y), or (F_x, F_y, F_tau / e) for soft fingertips, ``(rows, n, 2 or 3)``."""
    trace, e = run.trace, eccentricities(run.scenario)
    forces = trace.tangential_force.reshape(*trace.phase.shape, 2)
    if not e.any():
        return forces
    moments = np.divide(trace.torsional_moment, e, out=np.zeros(trace.phase.shape), where=e > 0.0)
    return np.dstack((forces, moments))


def slide_of(run: RunResult) -> np.ndarray:
    """The velocities that these oppose, (s_x', s_y') and e psi'."""
    trace, e = run.trace, eccentricities(run.scenario)
    velocities = trace.slip_velocity.reshape(*trace.phase.shape, 2)
    return np.dstack((velocities, e * trace.spin_velocity)) if e.any() else velocities


def _untrue_ends(run: RunResult, held: np.ndarray) -> dict[str, float]:
    """1 if a run ends at an instant with consistent phases of closed contacts."""
    by_jump = run.reason is not None and run.reason.value is None
    ends_so = run.outcome is Outcome.INCONSISTENT or (run.outcome is Outcome.SEPARATED and by_jump)
    if not ends_so:
        return {}
    if eccentricities(run.scenario).any():
        found = soft_instant.has_closed_answer(soft_instant.problem_at_end(run.scenario))
    else:
        found = spatial_instant.find_closed_answer(run, held) is not None
    return {run.outcome.value: 1.0} if found else {}


CHECKS = outcome_checks.CHECKS | {
    "ledger": Check("energy balance off by more than 1e-6 J and 1e-8 of the largest energy", "J"),
    "velocity": Check("velocities that differ at equal times by more than 1e-7", "m/s"),
}
JUDGE = Judge(CHECKS, measure_in_space)
