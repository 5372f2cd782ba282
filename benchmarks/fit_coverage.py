"""How often the 95 % intervals of fits hold the truth, on synthetic twins."""

from __future__ import annotations

from pathlib import Path

from benchmarks.report import Table, format_share
from slipgrasp.core.fit.fit import FitOptions, fit
from slipgrasp.core.fit.problem import FitProblem, Observations
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of

SEED = 1
TWINS = 200
DURATION = 0.5  # [s]
NOISE = {"object_pose": 2e-4, "slip": 2e-4}

CASES = {
    "paper-case-1": {
        "object.mass": 1.13,
        "fingers.0.friction": 0.27,
        "fingers.1.friction": 0.23,
    },
    "tilted-object": {"object.mass": 1.1, "fingers.0.friction": 0.42},
}
"""Scenarios, and the true values of what is free."""


def run(_docs: Path | None = None, seed: int = SEED, twins: int = TWINS) -> list[Table]:
    """The table ``fit-coverage``."""
    rows: list[tuple[str, ...]] = []
    for name, truth in CASES.items():
        report = fit(make_problem(name, truth), FitOptions(starts=1, seed=seed, twins=twins))
        assert report.coverage is not None
        for key, covered in report.coverage.covered.items():
            found = report.parameters[key]
            rows.append((name, key, found.kind, str(covered), format_share(covered, twins)))
    heads = ("scenario", "parameter", "class", f"of {twins}", "share (95 % interval)")
    return [Table("fit-coverage", heads, tuple(rows), page="fit.md")]


def make_problem(name: str, truth: dict[str, float]) -> FitProblem:
    """A fit of a run with these values, whose data have no noise: its twins are around the truth.

    Args:
        name: A preset.
        truth: What is free, and its true values.
    """
    base = with_values(load_scenario(name), {"simulation.duration": DURATION})
    true = with_values(base, truth)
    trace = simulate(true).trace
    columns = {c.name: (c.unit, c.values) for c in columns_of(trace) if not c.holds_phases}
    data = Observations.choose(trace.times, columns, NOISE)
    return FitProblem.make(true, [*truth], data)
