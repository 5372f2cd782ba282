"""Random objects held by spatial hands with laws that do not know the objects.

Objects as for planar hands (`benchmarks.robustness`), in the hand of `spatial-composite`: mass with
proportional inertias, three independent frictions, contacts up to 20 mm off centre along both
tangents; without noise, and with the noisy sensors of planar hands.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.report import Table, format_share, table_of_rows
from benchmarks.robustness_worlds import FRICTION, MASS, SEED
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.result import RunSummary
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

DURATION = 1.0
WORLDS = {"ideal": "spatial-composite", "noisy": "spatial-composite-noisy"}
OFFSET = 0.02  # [m]
ORACLE = "oracle: composite, given the truth"
LAWS: dict[str, dict[str, Any]] = {
    "theorem-4, `exact`": {"kind": "theorem-4", "distribution": "exact"},
    "theorem-4, `hold`": {"kind": "theorem-4", "distribution": "hold"},
    "composite, `softened`": {"distribution": "softened"},
    "composite, `hold`": {"distribution": "hold"},
    ORACLE: {"distribution": "hold"},
}
TARGET = 0.99  # of the objects that the oracle holds


def run() -> list[Table]:
    """The tables ``hold-in-space-ideal`` and ``hold-in-space-noisy``."""
    return [
        tabulate({law: list(simulate_many(vary_objects(law, 1000, world))) for law in LAWS}, world)
        for world in WORLDS
    ]


def vary_objects(law: str, count: int, world: str = "ideal") -> Iterator[Scenario]:
    """Runs of a law with the random objects, each with separate noise.

    Args:
        law: One of `LAWS`.
        count: Number of objects; the first ones are the same for every count and law.
        world: One of `WORLDS`.
    """
    chosen = {f"controller.{key}": value for key, value in LAWS[law].items()}
    base = with_values(load_scenario(WORLDS[world]), {"title": "", **chosen})
    if law == ORACLE:
        base = replace(base, estimates=())
    n, inertias = len(base.fingers), np.array(base.object.inertias)
    low, high = np.array([MASS, *[FRICTION] * n, *[(-OFFSET, OFFSET)] * (2 * n)]).T
    objects = np.random.default_rng(SEED).uniform(low, high, (count, 1 + 3 * n))
    for seed, drawn in enumerate(objects):
        mass, frictions, offsets = float(drawn[0]), drawn[1 : 1 + n], drawn[1 + n :].reshape(n, 2)
        values: dict[str, Any] = {
            "object.mass": mass,
            "object.inertias": (mass * inertias).tolist(),
            **{f"fingers.{i}.friction": float(mu) for i, mu in enumerate(frictions)},
            **{f"fingers.{i}.contact_offset": at.tolist() for i, at in enumerate(offsets)},
            "simulation.seed": seed,
            "simulation.duration": DURATION,
        }
        yield with_values(base, values)


def tabulate(runs: dict[str, Sequence[RunSummary]], world: str = "ideal") -> Table:
    """Fractions held by each law, of all objects and of those that the oracle held, and slip paths.

    Args:
        runs: Runs by law, in the order of the objects.
        world: World of the runs.
    """
    held = {law: np.array([run.metrics.held for run in those]) for law, those in runs.items()}
    by_oracle = held[ORACLE]
    rows = {}
    for law, own in held.items():
        paths = 1e3 * np.array([max(run.metrics.slip_path) for run in runs[law]])[own]
        rows[law] = {
            "held (95 % interval)": format_share(int(own.sum()), len(own)),
            "of what the oracle holds": format_share(
                int((own & by_oracle).sum()), int(by_oracle.sum())
            ),
            "longest slip of a run, median and worst of the held [mm]": (
                f"{np.median(paths):.3f}, {paths.max():.3f}" if own.any() else "–"
            ),
        }
    share = float((held["composite, `hold`"] & by_oracle).sum() / by_oracle.sum())
    outcome = "meets" if share >= TARGET else "misses"
    head = f"{len(by_oracle)} objects in space, {world} world, {DURATION:g} s"
    note = f"This {outcome} the target: composite with `hold` at least {TARGET:.0%} of the oracle."
    return table_of_rows(f"hold-in-space-{world}", head, rows, note, page="space.md")
