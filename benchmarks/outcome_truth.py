"""Runs at the default tolerances beside the same runs at tight ones: is any materially different?

Only runs whose truth is known count: well conditioned throughout, the same at two tight
tolerances and with an object heavier by a ten-billionth, so that what differs is the error of the
default and not chaos.
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
MOST = 4 * COUNT  # so many are drawn to find them
TIGHT, TIGHTER = (1e-11, 1e-13), (2e-12, 2e-14)  # relative and absolute tolerance
CONDITION = 1e4  # largest condition number of the reduced inertia and of its estimate
SETTLED = 0.1  # how far the tight runs may be apart, in limits
NUDGE = 1e-10  # by this share the object is heavier in one of them

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
    """One run beside its truth.

    Attributes:
        number: Index of the draw.
        known: Whether its truth is known.
        differences: How far each quantity is off, in limits.
    """

    number: int
    known: bool
    differences: dict[str, float]

    @property
    def is_material(self) -> bool:
        """Whether a truth that is known is missed."""
        return self.known and max(self.differences.values()) > 1.0


def measure_truth(seed: int, count: int = COUNT, most: int = MOST) -> Table:
    """The table ``outcomes-truth``.

    Args:
        seed: Other seeds draw other runs.
        count: How many runs whose truth is known.
        most: How many are drawn at most.
    """
    comparisons = in_processes(partial(_compare_drawn, seed), most)
    known = (comparison for comparison in comparisons if comparison.known)
    told = reported(known, count, "beside their truth", lambda found: found.is_material)
    return tabulate_truth(list(islice(told, count)))


def compare(scenario: Scenario, number: int = 0) -> Comparison:
    """Simulates a scenario at its own tolerances, at two tight ones, and nudged.

    Args:
        scenario: What to simulate.
        number: Index of the draw.
    """
    tight = _at(scenario, *TIGHT)
    truth = simulate(tight)
    known = _is_well_conditioned(truth) and all(
        max(_differences(simulate(other), truth).values()) <= SETTLED
        for other in (_at(scenario, *TIGHTER), _nudged(tight))
    )
    return Comparison(number, known, _differences(simulate(scenario), truth))


def tabulate_truth(comparisons: list[Comparison]) -> Table:
    """How many runs miss their truth, and by how much at worst."""
    rows = []
    for name, words in QUANTITIES.items():
        off = [comparison.differences[name] for comparison in comparisons]
        worst = "–" if name == "outcome" else f"{max(off, default=0.0):.1g}"
        rows.append((words, str(sum(by > 1.0 for by in off)), worst))
    missed = [comparison.number for comparison in comparisons if comparison.is_material]
    drawn = comparisons[-1].number + 1 if comparisons else 0
    told = f": indices {', '.join(map(str, missed))}" if missed else ""
    note = (
        f"{drawn} runs were drawn for {len(comparisons)} whose truth is known. "
        f"Target: none; {'missed' if missed else 'met'}{told}."
    )
    heads = ("differs from the truth in", f"of {len(comparisons)}", "largest, in limits")
    return Table("outcomes-truth", heads, tuple(rows), (note,), "verification.md")


def _compare_drawn(seed: int, index: int) -> Comparison:
    return compare(draw(ANYWHERE, seed, index), index)


def _at(scenario: Scenario, relative: float, absolute: float) -> Scenario:
    values = {
        "simulation.relative_tolerance": relative,
        "simulation.absolute_tolerance": absolute,
    }
    return with_values(scenario, values)


def _nudged(scenario: Scenario) -> Scenario:
    return with_values(scenario, {"object.mass": scenario.object.mass * (1.0 + NUDGE)})


def _is_well_conditioned(run: RunResult) -> bool:
    conditions = run.trace.inertia_condition, run.trace.estimated_inertia_condition
    return max(float(np.max(condition)) for condition in conditions) < CONDITION


def _differences(run: RunResult, truth: RunResult) -> dict[str, float]:
    """How far a run is from its truth, in limits."""
    paths, true_paths = np.array(run.metrics.slip_path), np.array(truth.metrics.slip_path)
    allowed = np.maximum(SHARE * true_paths, SLIP)
    return {
        "outcome": 0.0 if run.outcome is truth.outcome else np.inf,
        "end": abs(run.end_time - truth.end_time) / max(SHARE * truth.end_time, 1e-9),
        "slip": float(np.max(np.abs(paths - true_paths) / allowed)),
        "pose": _pose_difference(run, truth),
    }


def _pose_difference(run: RunResult, truth: RunResult) -> float:
    """At the instants that both traces have, and at the end if both end at about the same time."""
    _, own, true = np.intersect1d(run.trace.times, truth.trace.times, return_indices=True)
    own, true = np.append(own, -1), np.append(true, -1)
    off = np.abs(run.trace.object_pose[own] - truth.trace.object_pose[true])
    return float(np.max(off / POSE))
