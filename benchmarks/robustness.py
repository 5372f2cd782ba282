"""Comparison of control laws with objects of unknown mass and friction.

Every law in every world with its best tracking controller (`benchmarks.robustness_gains`); the
paper's law as printed, and its missing parts; a map over the two friction coefficients; the
sensitivity of single outcomes of the printed law; and noise and latency up to the failure of the
composite law (`benchmarks.robustness_sweeps`). All laws are tested with the same random objects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import Table, format_share
from benchmarks.robustness_charts import draw_success_maps, draw_sweeps
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

COUNT = 1000
SEED = 20
DURATION = 1.0
MASS, FRICTION = (0.5, 2.0), (0.15, 0.6)
INERTIA_PER_MASS = 0.01042
MAP_SIDE = 31
WORLDS = {"ideal": "composite-case-2", "noisy": "composite-case-2-noisy"}
ORACLE = "oracle: composite, given the truth"
PRINTED = "theorem-4, as printed"
HELD = "held (95 % interval)"
LAWS = ("theorem-3", "theorem-4", PRINTED, "certainty-equivalence", "composite", ORACLE)
EXACT = {"controller.distribution": "exact", "controller.prediction": False}
# Changes that should not affect a run, and their sizes.
DISTURBANCES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "tolerances a thousandth": {
        "simulation.relative_tolerance": 1e-11,
        "simulation.absolute_tolerance": 1e-13,
    },
    "steps of 0.5 ms at most": {"simulation.max_step": 5e-4},
    "steps of 0.1 ms at most": {"simulation.max_step": 1e-4},
    "estimated mass 1e-9 kg larger": {"estimates.2.initial": 0.5 + 1e-9},
}


def run(docs: Path | None = None, cells: Path | None = None) -> list[Table]:
    """The tables of the page, whose names start with ``robustness-``, and its diagrams.

    Args:
        docs: Folder of the diagrams.
        cells: File of `benchmarks.robustness_gains`; its cells are not measured again.
    """
    # Those modules import this one.
    from benchmarks.robustness_gains import measure_cells, plan
    from benchmarks.robustness_start import measure_start
    from benchmarks.robustness_sweeps import SWEEPS, measure_sweep, tabulate_sweep
    from benchmarks.robustness_tables import draw_shares, tabulate

    found = measure_cells(plan(), cells)
    sweeps = [measure_sweep(sweep) for sweep in SWEEPS]
    if docs is not None:
        draw_shares(found, docs / "images" / "robustness.png")
        draw_sweeps(sweeps, docs / "images" / "robustness-sweeps.png")
        sides = np.linspace(*FRICTION, MAP_SIDE)
        maps = {law: _success_map(law, sides) for law in (PRINTED, "composite")}
        draw_success_maps(sides, maps, docs / "images" / "success-maps.png")
    return [
        *tabulate(found),
        measure_start(),
        measure_outcomes(COUNT),
        *(tabulate_sweep(sweep) for sweep in sweeps),
    ]


def random_objects(count: int, fingers: int = 2, seed: int = SEED) -> np.ndarray:
    """Mass [kg] and friction coefficients, uniform and independent: ``(count, 1 + fingers)``."""
    low, high = np.array([MASS, *[FRICTION] * fingers]).T
    return np.random.default_rng(seed).uniform(low, high, (count, 1 + fingers))


def noise_seed(number: int, seed: int) -> int:
    """Seed of the noise of one object of a draw; every object has a different one."""
    return number + 10**6 * (seed - SEED)


def measure_outcomes(count: int) -> Table:
    """Number of outcomes of the printed law that change with irrelevant changes.

    Args:
        count: Number of objects.
    """
    base, objects = load_scenario(WORLDS["ideal"]), random_objects(count)
    varied = list(vary_objects(base, PRINTED, objects))
    held, rows = np.zeros(count, bool), []
    for words, values in DISTURBANCES.items():
        runs = simulate_many(with_values(scenario, values) for scenario in varied)
        outcomes = np.array([run.metrics.held for run in runs])
        if not values:
            held = outcomes
        changed = format_share(int(np.sum(outcomes != held)), count) if values else "–"
        rows.append((words, format_share(int(outcomes.sum()), count), changed))
    heads = (
        f"{PRINTED}, {count} objects, ideal world",
        HELD,
        "another outcome than as it is",
    )
    return Table("robustness-outcomes", heads, tuple(rows), page="robustness.md")


def vary_objects(
    base: Scenario, law: str, objects: np.ndarray, seed: int = SEED
) -> Iterator[Scenario]:
    """One run of a second per object, each with separate noise.

    Args:
        base: Hand, motion and sensors.
        law: One of `LAWS`.
        objects: Mass and friction coefficients, ``(objects, 1 + fingers)``.
        seed: Seed of their draw.
    """
    base = _with_law(base, law)
    for k, (mass, *frictions) in enumerate(objects.tolist()):
        yield with_values(
            base,
            {
                "object.mass": mass,
                "object.inertia": INERTIA_PER_MASS * mass,
                **{f"fingers.{i}.friction": friction for i, friction in enumerate(frictions)},
                "simulation.seed": noise_seed(k, seed),
                "simulation.duration": DURATION,
            },
        )


def _with_law(base: Scenario, law: str) -> Scenario:
    """The base with a law; the paper's laws with required settings, the printed one as printed."""
    if law == ORACLE:
        return replace(base, estimates=())
    if law == "composite":
        return base
    if law == PRINTED:
        free = tuple(replace(e, minimum=None, maximum=None) for e in base.estimates)
        law, base = (
            "theorem-4",
            with_values(replace(base, estimates=free), {"controller.velocity_gain": 10.0}),
        )
    return with_values(base, {"controller.kind": law, **EXACT})


def _success_map(law: str, sides: np.ndarray) -> np.ndarray:
    """Longest slip path [mm] for each pair of friction coefficients, NaN if an object is lost."""
    pairs = [(1.0, left, right) for right in sides for left in sides]
    base = load_scenario(WORLDS["ideal"])
    runs = simulate_many(vary_objects(base, law, np.array(pairs)))
    paths = [1e3 * max(r.metrics.slip_path) if r.metrics.held else np.nan for r in runs]
    return np.reshape(paths, (len(sides), len(sides)))
