"""Whether random soft grasps end truly, with every wrench of a contact inside its limit surface.

Hands of two to four fingers of every kind, with pads on some or all fingertips, are judged as those
of `benchmarks.hands_in_space`, and by what soft fingertips add. A law that does not know of their
moments must be refused in a sentence.
"""

from __future__ import annotations

import re

import numpy as np

from benchmarks import hands_in_space
from benchmarks.hands_in_space import (
    SAME_VELOCITY,
    eccentricities,
    friction_of,
    measure_in_space,
    slide_of,
)
from benchmarks.outcome_checks import Check, Judge, Pair, ledger_error, velocity_jump
from benchmarks.outcomes import SEED, judge_many, tabulate
from benchmarks.random_runs import SOFT_GRASPS
from benchmarks.report import Table
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values

COUNT = 5_000
SURE_SPEED, OFF_SLIP = 1e-5, 1e-3  # [m/s], [rad]
LEVER = 0.1  # of what moves with an object that stops turning [m]
INTERNAL = ("event_stall", "max_steps", "nonfinite_state", "step_underflow", "stiff_loop")
REFUSED = ("theorem-3", "theorem-4")
SENTENCE = re.compile(
    r"controller\.kind is '\S+', which is not computed for soft fingertips yet; .+"
)


def run(seed: int = SEED, count: int = COUNT) -> list[Table]:
    """The tables ``soft-grasps`` and ``soft-grasps-endings``."""
    return tabulate([judge_many(SOFT_GRASPS, count, seed, JUDGE)], "soft-grasps")


def measure_soft(pair: Pair) -> dict[str, float]:
    """Deviation of each check by name: `outcome_checks.Judge.measure`."""
    reason, scenario = pair.plain.reason, pair.plain.scenario
    return measure_in_space(pair) | {
        "ledger": max(ledger_error(run.trace) for run in pair.runs),
        "velocity": max(_velocity_jump(run) for run in pair.runs),
        "against": max(map(_off_slip, pair.runs)),
        "internal": float(reason is not None and reason.code in INTERNAL),
        "refusal": float(sum(not _is_refused(scenario, law) for law in REFUSED)),
    }


def _off_slip(run: RunResult) -> float:
    """The largest angle between friction and the opposite of a slip that is fast enough [rad].

    At its onset a slip has the friction of its step.
    """
    force, slide = friction_of(run), _slide_after_creep(run)
    sizes, speeds = np.linalg.norm(force, axis=2), np.linalg.norm(slide, axis=2)
    rows = (run.trace.phase != 0) & (speeds >= SURE_SPEED) & (sizes > 0.0)
    if run.outcome.ended_by_physics:
        rows &= (run.trace.times < run.end_time)[:, None]
    apart = np.linalg.norm(
        force[rows] / sizes[rows, None] + slide[rows] / speeds[rows, None], axis=1
    )
    worst = float(apart.max(initial=0.0))
    return worst if worst > OFF_SLIP else 0.0


def _slide_after_creep(run: RunResult) -> np.ndarray:
    """Slip velocities without the creep of contacts that still stick in another row of the instant.

    Undetermined moments let contacts in stick turn at up to 3e-9 m/s per N. A slip begins with this
    velocity and the friction of stick.
    """
    trace, slide = run.trace, slide_of(run)
    begins = (np.diff(trace.times) == 0.0)[:, None] & (trace.phase[:-1] == 0)
    begins &= trace.phase[1:] != 0
    crept = np.where(begins[:, :, None], slide[:-1], 0.0)
    return np.concatenate((slide[:1], slide[1:] - crept))


def _velocity_jump(run: RunResult) -> float:
    """The largest difference of a velocity between rows at one time; 0 if allowed.

    A slip that is slower than 3e-9 m/s ends, and a turn where that is its e psi'; other parts of
    the object move with it.
    """
    e = eccentricities(run.scenario)
    turns = 1.0 / float(e[e > 0.0].min())
    moves = 1.0 + LEVER * turns
    columns = [moves] * 3 + [turns] * 3 + [moves] * (2 * len(e))
    return velocity_jump(run.trace, SAME_VELOCITY * np.array(columns))


def _is_refused(scenario: Scenario, law: str) -> bool:
    try:
        with_values(scenario, {"controller.kind": law})
    except ScenarioError as error:
        return any(SENTENCE.fullmatch(each.message) for each in error.errors)
    return False


CHECKS = hands_in_space.CHECKS | {
    "cone": Check("a wrench outside its limit surface, or off it in slip, by more than 1e-9"),
    "ledger": Check("energy balance off by more than 1e-6 J and 1e-9 of the largest energy", "J"),
    "against": Check("friction off a slip above 10 um/s by more than 1e-3", "rad"),
    "internal": Check("an end for a numerical reason"),
    "refusal": Check("a law without moments that is not refused with a message"),
}
JUDGE = Judge(CHECKS, measure_soft)
