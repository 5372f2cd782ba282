"""How often fits of runs without slip state the bound max F_t / F_n of a friction, not a number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.fit_coverage import POSES, SEED, TWINS, problem_of, simulate_briefly
from benchmarks.report import Table
from slipgrasp.core.fit.fit import FitOptions, fit
from slipgrasp.core.fit.problem import FitProblem
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start

FRICTIONS = ("fingers.0.friction", "fingers.1.friction")


# Runs of presets in which no contact slips, under a law that does not use friction.
CASES: dict[str, dict[str, Any]] = {
    "paper-case-1": {"controller.kind": "pd-gravity", "controller.grip_force": 40.0},
    "gripper-lift": dict.fromkeys(FRICTIONS, 0.5),
}


def run(seed: int = SEED, twins: int = TWINS) -> list[Table]:
    """The table ``fit-stick``."""
    rows = []
    for preset, changes in CASES.items():
        stuck = simulate_briefly(preset, changes)
        reports = [fit(twin, FitOptions(starts=1)) for twin in twins_of(stuck, seed, twins)]
        for key, used in zip(FRICTIONS, used_friction(stuck), strict=True):
            found = [report.parameters[key] for report in reports]
            lows = np.array([f.low for f in found if f.kind == "only below" and f.value is None])
            equal = int(np.isclose(lows, used, rtol=1e-9).sum())
            rows.append((preset, key, f"{used:.4f}", str(len(lows)), str(equal)))
    heads = ("scenario", "parameter", "max F_t / F_n", f"bound alone, of {twins}", "equal to it")
    return [Table("fit-stick", heads, tuple(rows), page="fit.md")]


def twins_of(stuck: RunResult, seed: int, twins: int) -> Iterator[FitProblem]:
    """Fits of the two frictions of a run, each to its poses and slips with other noise."""
    problem = problem_of(stuck, FRICTIONS, POSES)
    data = problem.data
    for number in range(twins):
        noise = np.random.default_rng([seed, number]).standard_normal(data.values.shape)
        yield problem.with_data(replace(data, values=data.values + data.sigmas * noise))


def used_friction(stuck: RunResult) -> list[float]:
    """Largest ratio of tangential to normal force of each contact of a run without slip."""
    trace = stuck.trace[rows_from_start(stuck.trace)]
    assert not trace.phase.any(), "no contact slips in these runs"
    ratios: list[float] = (trace.tangential_size / trace.normal_force).max(axis=0).tolist()
    return ratios
