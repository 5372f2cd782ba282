"""Effect of each choice that the paper leaves open: both cases with one choice changed.

The runs are those of the studies ``docs/studies/assumptions-case-1.toml`` and ``…-case-2.toml``.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from benchmarks.report import Table
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.result import RunSummary
from slipgrasp.core.study.loading import load_study

CASES = (1, 2)
STUDIES = Path(__file__).parents[1] / "docs" / "studies"
SHORTEST = 1e-5  # smaller slip paths count as this one [m]
TEXTS = {
    "controller.lyapunov_weight": "weight $Q$",
    "controller.slip_position_gain": "gain of the slips $K_{p2}$ [1/s²]",
    "controller.grasp_force": "grasp force $y$",
    "controller.grip_safety": "distance from the cones",
    "controller.minimum_normal_force": "least normal force [N]",
    "controller.control_period": "control period [s]",
    "controller.recognition_time": "recognition time [s]",
    "controller.estimate_norm_bound": "$\\varphi_0$",
    "fingers.*.link_inertia_fractions.0": "inertia of the links, share of $m l^2$",
    "fingers.*.link_centre_fractions.0": "centres of mass of the links, share of $l$",
    "fingers.0.base.0": "left base $x$ [m], the right one mirrored",
    "fingers.0.elbow": "elbow of the left finger, the right one mirrored",
    "fingers.0.contact_offset": "left fingertip above the middle [m], the right one mirrored",
    "object.face_half_length": "half length of the faces [m]",
    "simulation.gravity": "gravity [m/s²]",
    "estimates.0.minimum": "bounds on the estimates",
}


class Choice(NamedTuple):
    """One changed choice.

    Attributes:
        name: The choice and its value.
        runs: Runs of the preset and of the changed choice by case; None if it does not apply.
    """

    name: str
    runs: tuple[tuple[RunSummary, RunSummary] | None, ...]

    @property
    def effect(self) -> float:
        """The largest change of a slip path, as a logarithm; infinite if an object is lost."""
        return max(_effect(*pair) for pair in self.runs if pair is not None)


def run() -> list[Table]:
    """The table ``assumptions``, ordered by effect."""
    choices = measure()
    heads = ["choice"]
    for case in CASES:
        heads += [f"case {'I' * case}: slip [mm]", "ends [s]", "rms error [mm]"]
    first = [next(pair for c in choices if (pair := c.runs[k]) is not None)[0] for k in (0, 1)]
    rows = [("as in the presets", *(cell for run in first for cell in _cells(run)))]
    for choice in choices:
        cells = (_cells(pair[1]) if pair else ("–",) * 3 for pair in choice.runs)
        rows.append((choice.name, *(cell for group in cells for cell in group)))
    return [Table("assumptions", tuple(heads), tuple(rows), page="assumptions.md")]


def measure() -> list[Choice]:
    """Runs both studies; returns the choices in decreasing order of effect."""
    found: dict[str, dict[int, tuple[RunSummary, RunSummary]]] = {}
    for case in CASES:
        study = load_study(STUDIES / f"assumptions-case-{case}.toml")
        indices = range(study.num_runs)
        default, *others = simulate_many([study.scenario_of(i) for i in indices])
        for i, summary in zip(indices[1:], others, strict=True):
            found.setdefault(_name(study.values_of(i)), {})[case] = (default, summary)
    choices = [
        Choice(name, tuple(runs.get(case) for case in CASES)) for name, runs in found.items()
    ]
    return sorted(choices, key=lambda choice: -choice.effect)


def _name(values: dict[str, object]) -> str:
    key, value = next(iter(values.items()))
    text = TEXTS[key]
    if key.endswith("minimum"):
        return f"{text}: physical"
    if isinstance(value, list | tuple):
        return f"{text}: {value[0]:g}, of the slips {value[-1]:g}"
    return f"{text}: {value:g}" if isinstance(value, float) else f"{text}: {value}"


def _effect(default: RunSummary, other: RunSummary) -> float:
    if not other.metrics.held:
        return math.inf
    paths = [max(*run.metrics.slip_path, SHORTEST) for run in (default, other)]
    return abs(math.log(paths[1] / paths[0]))


def _cells(run: RunSummary) -> tuple[str, str, str]:
    metrics = run.metrics
    error = f"{1e3 * math.hypot(*metrics.rms_tracking_error[:2]):.1f}"
    path = f"{1e3 * max(metrics.slip_path):.3g}"
    if not metrics.held:
        return path, f"`{run.outcome.value}` {run.end_time:.3f}", error
    end = metrics.last_slip_time
    return path, "–" if end is None else f"{end:.4f}", error
