"""Runs at the default tolerances, compared with the same runs at tight tolerances.

Only runs with a known true result count: well conditioned throughout, and equal at two tight
tolerances and with an object that is heavier by 1e-10, so that differences are errors of the
default tolerances and not chaos.
"""

from __future__ import annotations

from functools import partial
from itertools import islice
from typing import NamedTuple

import numpy as np

from benchmarks.random_runs import ANYWHERE, draw, in_processes, reported
from benchmarks.report import Table
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values

COUNT = 1000
MOST = 4 * COUNT  # number of draws to find them
TIGHT, TIGHTER = (1e-11, 1e-13), (2e-12, 2e-14)  # relative and absolute tolerance
CONDITION = 1e4  # largest condition number of the reduced inertia and of its estimate
SETTLED = 0.1  # allowed difference of the tight runs, in limits
NUDGE = 1e-10  # relative increase of the mass in one of them

SHARE = 0.01  # of end time and slip path
SLIP = 1e-7  # [m]
POSE = np.array([1e-4, 1e-4, 1e-3])  # [m, m, rad]: the angle at 0.1 m from the centre
QUANTITIES = {
    "outcome": "another outcome",
    "end": "end of the run by more than 1 %",
    "slip": "slip path by more than 1 % and 0.1 µm",
    "pose": "pose by more than 0.1 mm or 1 mrad",
}


class Comparison(NamedTuple):
    """One run, compared with its true result.

    Attributes:
        number: Index of the draw.
        known: Whether the true result is known.
        differences: Deviation of each quantity, in limits.
    """

    number: int
    known: bool
    differences: dict[str, float]

    @property
    def is_material(self) -> bool:
        """Whether the run differs from its known true result."""
        return self.known and max(self.differences.values()) > 1.0


def measure_truth(seed: int, count: int = COUNT, most: int = MOST) -> Table:
    """The table ``outcomes-truth``.

    Args:
        seed: Seed of the runs.
        count: Number of runs with a known true result.
        most: Largest number of draws.
    """
    comparisons = in_processes(partial(_compare_drawn, seed), most)
    known = (comparison for comparison in comparisons if comparison.known)
    told = reported(known, count, "beside their truth", lambda found: found.is_material)
    return tabulate_truth(list(islice(told, count)))


def compare(scenario: Scenario, number: int = 0) -> Comparison:
    """Simulates a scenario at its tolerances, at two tight ones, and with a perturbed mass.

    Args:
        scenario: Scenario to simulate.
        number: Index of the draw.
    """
    truth = simulate(_at(scenario, TIGHT))
    conditions = truth.trace.inertia_condition, truth.trace.estimated_inertia_condition
    known = max(float(np.max(each)) for each in conditions) < CONDITION and all(
        max(_differences(simulate(other), truth).values()) <= SETTLED
        for other in (_at(scenario, TIGHTER), _at(scenario, TIGHT, NUDGE))
    )
    return Comparison(number, known, _differences(simulate(scenario), truth))


def tabulate_truth(comparisons: list[Comparison]) -> Table:
    """Number of runs that differ from their true results, and the largest deviations."""
    rows = []
    for name, words in QUANTITIES.items():
        off = [comparison.differences[name] for comparison in comparisons]
        worst = "–" if name == "outcome" else f"{max(off, default=0.0):.1g}"
        rows.append((words, str(sum(by > 1.0 for by in off)), worst))
    missed = [comparison.number for comparison in comparisons if comparison.is_material]
    drawn = comparisons[-1].number + 1 if comparisons else 0
    told = f": indices {', '.join(map(str, missed))}" if missed else ""
    note = (
        f"{drawn} runs drawn to obtain {len(comparisons)} with a reliable reference. "
        f"Target: no violations. {'Missed' if missed else 'Met'}{told}."
    )
    heads = ("differs from the truth in", f"of {len(comparisons)}", "largest, in limits")
    return Table("outcomes-truth", heads, tuple(rows), (note,), "verification.md")


def _compare_drawn(seed: int, index: int) -> Comparison:
    return compare(draw(ANYWHERE, seed, index), index)


def _at(scenario: Scenario, tolerances: tuple[float, float], nudge: float = 0.0) -> Scenario:
    """With relative and absolute tolerance, and perhaps a mass larger by a fraction."""
    relative, absolute = tolerances
    values = {
        "simulation.relative_tolerance": relative,
        "simulation.absolute_tolerance": absolute,
        "object.mass": scenario.object.mass * (1.0 + nudge),
    }
    return with_values(scenario, values)


def _differences(run: RunResult, truth: RunResult) -> dict[str, float]:
    """Deviations of a run from its true result, in limits."""
    paths, true_paths = np.array(run.metrics.slip_path), np.array(truth.metrics.slip_path)
    allowed = np.maximum(SHARE * true_paths, SLIP)
    # At the instants that both traces have, and at the end if both end at about the same time.
    _, own, true = np.intersect1d(run.trace.times, truth.trace.times, return_indices=True)
    poses, true_poses = run.trace.object_pose, truth.trace.object_pose
    off = np.abs(poses[np.append(own, -1)] - true_poses[np.append(true, -1)])
    return {
        "outcome": 0.0 if run.outcome is truth.outcome else np.inf,
        "end": abs(run.end_time - truth.end_time) / max(SHARE * truth.end_time, 1e-9),
        "slip": float(np.max(np.abs(paths - true_paths) / allowed)),
        "pose": float(np.max(off / POSE)),
    }
