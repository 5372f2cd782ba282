"""Whether random hands in space end truly, with every force inside its cone or pyramid.

Runs are drawn at the ends of their ranges and judged by their traces; where no phases agree, or a
contact can only open under a new torque, an independent search looks for an answer
(`tests.references.spatial_instant`).

`python -m benchmarks.hands_in_space INDEX [--seed N]` prints a single run as a scenario file, and
what is wrong with it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.outcome_checks import (
    CHECKS,
    OUTSIDE_CONE,
    Check,
    Judgement,
    ends_wrongly,
    given_back,
    ledger_error,
    simulate_with_torques,
    stalled,
    velocity_jump,
)
from benchmarks.outcomes import SEED, judge_many, tabulate
from benchmarks.random_runs import IN_SPACE, draw
from benchmarks.report import Table
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_to_toml
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.types import Outcome

COUNT = 5_000
LEDGER_SHARE = 1e-8  # of the greatest energy of the run: the relative tolerance of the steps
# With more output steps end elsewhere in space: not all that happens has the same digits then.
CHECKS_IN_SPACE = {name: check for name, check in CHECKS.items() if name != "rate"} | {
    "ledger": Check("energy ledger off by more than 1e-6 J and 1e-8 of the greatest energy", "J")
}


def run(_docs: Path | None = None, seed: int = SEED) -> list[Table]:
    """The tables ``hands-in-space`` and ``hands-in-space-endings``."""
    campaign = judge_many(IN_SPACE, COUNT, seed, judge_in_space)
    return tabulate([campaign], "hands-in-space", CHECKS_IN_SPACE)


def judge_in_space(scenario: Scenario) -> Judgement:
    """Runs a scenario in space and judges what became of it.

    Args:
        scenario: What to simulate.
    """
    run, held = simulate_with_torques(scenario)
    return Judgement(run.outcome.value, find_missed_in_space(run, held))


def find_missed_in_space(run: RunResult, held: np.ndarray) -> dict[str, float]:
    """By how much each check that fails is missed, by its name.

    Args:
        run: The run.
        held: The torques that act at its end, ``(n, 3)`` [N m].
    """
    missed = {
        "stall": stalled(run),
        "friction": given_back(run.trace),
        "cone": _outside_friction(run),
        "ledger": ledger_error(run.trace, LEDGER_SHARE),
        "velocity": velocity_jump(run.trace),
        **_untrue_ends(run, held),
        "completed": ends_wrongly(run),
    }
    return {name: by for name, by in missed.items() if by > 0.0}


def _outside_friction(run: RunResult) -> float:
    """The largest excess over cone or pyramid, or distance from it in slip, relative.

    Rows are those that `benchmarks.outcome_checks` looks at in the plane.
    """
    trace, scenario = run.trace, run.scenario
    assert isinstance(scenario, SpatialScenario)
    rows = np.arange(len(trace)) > 0
    if run.outcome.ended_by_physics:
        rows &= trace.times < run.end_time
    forces = trace.tangential_force.reshape(*trace.phase.shape, 2)[rows]
    phases = trace.phase[rows].astype(float)
    normal = trace.normal_force[rows]
    bound = (trace.friction_coefficient[rows] * normal)[:, :, None]
    against = -bound * _directions(run, phases, rows)
    slips = (phases != 0.0)[:, :, None]
    if scenario.has_pyramid:
        # Beside a slip along one tangent, the other one sticks with static friction.
        most = bound * np.where(slips, _static_over_kinetic(run)[rows][:, :, None], 1.0)
        slips = against != 0.0
        excess = np.where(slips, np.abs(forces - against), np.abs(forces) - most)
    else:
        size = np.linalg.norm(forces, axis=2, keepdims=True)
        off = np.linalg.norm(forces - against, axis=2, keepdims=True)
        excess = np.where(slips, off, size - bound)
    scale = 1.0 + np.linalg.norm(forces, axis=2) + np.abs(normal)
    worst = float((excess / scale[:, :, None]).max(initial=0.0))
    return worst if worst > OUTSIDE_CONE else 0.0


def _static_over_kinetic(run: RunResult) -> np.ndarray:
    """How many times more friction a contact has in stick at every row, ``(rows, n)``."""
    times, fingers = run.trace.times, run.scenario.fingers
    ratios = np.ones((len(times), len(fingers)))
    for i, finger in enumerate(fingers):
        if finger.static_friction is None:
            continue
        key = f"fingers.{i}.friction"
        changes = [(c.time, float(c.value)) for c in run.scenario.changes if c.parameter == key]
        for time, friction in [(0.0, finger.friction), *sorted(changes)]:
            after = finger.static_friction / friction
            # Of the two rows of an instant either may be the one before.
            ratios[times == time, i] = max(after, *ratios[times == time, i], 1.0)
            ratios[times > time, i] = after
    return ratios


def _directions(run: RunResult, phases: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Where contacts slip to, ``(rows, n, 2)``: by phase, or by slip velocity where it is one.

    On the cone a slip that has just begun keeps the direction of its beginning for a while; there
    that of the force is taken, which leaves its size to be judged.
    """
    if run.scenario.simulation.friction == "pyramid":
        signs = np.where(phases == 0.0, 0.0, phases - 7.0)
        first = np.round(signs / 3.0)
        return np.stack([first, signs - 3.0 * first], axis=2)
    trace = run.trace[rows]
    velocity = trace.slip_velocity.reshape(*phases.shape, 2)
    force = trace.tangential_force.reshape(*phases.shape, 2)
    speed = np.linalg.norm(velocity, axis=2, keepdims=True)
    pull = -force / np.maximum(np.linalg.norm(force, axis=2, keepdims=True), 1e-300)
    return np.where(speed >= SURE_SPEED, velocity / np.maximum(speed, SURE_SPEED), pull)


SURE_SPEED = 1e-7  # [m/s]


def _untrue_ends(run: RunResult, held: np.ndarray) -> dict[str, float]:
    """1 where a run ends at an instant at which some phases of closed contacts agree."""
    by_jump = run.reason is not None and run.reason.value is None
    ends_so = run.outcome is Outcome.INCONSISTENT or (run.outcome is Outcome.SEPARATED and by_jump)
    if not ends_so:
        return {}
    from tests.references.spatial_instant import find_closed_answer

    found = find_closed_answer(run, held) is not None
    return {run.outcome.value: 1.0} if found else {}


def main() -> None:
    """Prints one run as a scenario file, and what is wrong with it."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.hands_in_space", description=main.__doc__
    )
    parser.add_argument("index", type=int)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    prepare_kernel()
    scenario = draw(IN_SPACE, options.seed, options.index)
    judgement = judge_in_space(scenario)
    print(scenario_to_toml(scenario))
    print(f"# {judgement.outcome}")
    for name, by in judgement.missed.items():
        print(f"# {CHECKS_IN_SPACE[name].text}: {by:g} {CHECKS_IN_SPACE[name].unit}".rstrip())


if __name__ == "__main__":
    main()
