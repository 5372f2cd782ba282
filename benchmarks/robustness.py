"""Comparison of control laws with objects of unknown mass and friction.

Every law in every world with its best tracking controller (`benchmarks.robustness_gains`). For one
second, from the paper's estimates: the paper's law as printed, and its missing parts; a map over
the two friction coefficients; the sensitivity of single outcomes of the printed law; and noise and
latency up to the failure of the composite law. All laws are tested with the same random objects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from benchmarks.charts import draw_success_maps, save
from benchmarks.report import Table, format_share, table_of_columns, table_of_rows
from benchmarks.robustness_gains import (
    GAINS,
    MORE_GAINS,
    Gains,
    Result,
    describe,
    measure_best,
    measure_cells,
    plan,
    set_gains,
    tabulate,
)
from benchmarks.robustness_worlds import (
    EXACT,
    FIRST_FORCE,
    FIRST_FRICTION,
    FRICTION,
    SEED,
    Held,
    random_objects,
    vary_objects,
)
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.result import RunSummary
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.definition import apply_values
from slipgrasp.core.trace.types import Outcome

PAGE = "robustness.md"
COUNT = 1000
TUNED = 60  # objects for the choice of gains
FEWER = 300  # objects at every point of a sweep
FAILED = 0.5  # the law fails if it holds less
MAP_SIDE = 31
WORLDS = {"ideal": "composite-case-2", "noisy": "composite-case-2-noisy"}
ORACLE = "oracle: composite, given the truth"
PRINTED = "theorem-4, as printed"
_THEOREM_4 = {"controller.kind": "theorem-4", **EXACT}
_FREE: dict[str, Any] = dict.fromkeys(("estimates.*.minimum", "estimates.*.maximum"))
LAWS: dict[str, dict[str, Any]] = {
    "theorem-3": {"controller.kind": "theorem-3", **EXACT},
    "theorem-4": _THEOREM_4,
    PRINTED: {**_THEOREM_4, **_FREE, "controller.velocity_gain": 10.0},
    "certainty-equivalence": {"controller.kind": "certainty-equivalence", **EXACT},
    "composite": {},
    ORACLE: {"estimates": []},
}
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
    """The tables of the page, whose names start with ``robustness-``, and its maps.

    Args:
        docs: Folder of the maps.
        cells: File of `benchmarks.robustness_gains`; its cells are not measured again.
    """
    found = measure_cells(plan(), cells)
    if docs is not None:
        sides = np.linspace(*FRICTION, MAP_SIDE)
        maps = {law: _success_map(law, sides) for law in (PRINTED, "composite")}
        save(draw_success_maps(sides, maps), docs / "images" / "success-maps.png")
    return [*tabulate(found), measure_start(), measure_outcomes(), *map(measure_sweep, SWEEPS)]


def simulate_objects(
    base: Scenario, law: str, objects: np.ndarray, seed: int = SEED
) -> list[RunSummary]:
    """One run of a second per object, each with separate noise.

    Args:
        base: Hand, motion and sensors.
        law: One of `LAWS`.
        objects: Mass and friction coefficients, ``(objects, 1 + fingers)``.
        seed: Seed of their draw.
    """
    return list(simulate_many(vary_objects(with_law(base, law), objects, seed)))


def with_law(base: Scenario, law: str) -> Scenario:
    """The base with a law; the paper's laws with required settings, the printed one as printed."""
    return apply_values(base, LAWS[law])


def hold_at_best(base: Scenario, law: str, tuned: int, count: int) -> Result:
    """Simulates a law with random objects for a second, with its best gains.

    Args:
        base: Hand, motion and sensors.
        law: One of `LAWS`.
        tuned: Number of objects for the choice of gains; 0 for the gains of the base and law.
        count: Number of objects of the results.
    """
    controller = with_law(base, law).controller
    own = cast("Gains", (controller.position_gain, controller.velocity_gain))
    gains, more = (GAINS, MORE_GAINS) if tuned else ((own,), ())

    def run(chosen: Gains, number: int, seed: int) -> list[Held]:
        objects = random_objects(number, len(base.fingers), seed)
        return [
            Held(run.metrics.held, run.outcome is Outcome.COMPLETED, max(run.metrics.slip_path))
            for run in simulate_objects(with_values(base, set_gains(chosen)), law, objects, seed)
        ]

    return measure_best(run, tuned or 1, count, gains, more)


def measure_start(count: int = COUNT, tuned: int = TUNED) -> Table:
    """Laws that start from the paper's estimates, and the missing parts of its law as printed.

    Case II starts from a friction estimate of 1.2, twice the largest friction of the random
    objects: the initial grip is too weak for all of them.

    Args:
        count: Number of objects of the results.
        tuned: Number of objects for the choice of gains.
    """
    estimates = {f"estimates.{i}.initial": FIRST_FRICTION for i in range(2)}
    rows = {law: (law, {}) for law in LAWS}
    rows[f"{PRINTED}, first grip {FIRST_FORCE:g} N"] = (PRINTED, estimates)

    def hold(preset: str, law: str, values: Mapping[str, Any]) -> str:
        base = with_values(load_scenario(preset), values)
        return describe(hold_at_best(base, law, 0 if law == PRINTED else tuned, count))

    columns = {
        f"{world} world": [hold(preset, *row) for row in rows.values()]
        for world, preset in WORLDS.items()
    }
    note = (
        f"{count} objects, 1 s: held, with the 95 % interval; gains K_p/K_v, chosen on {tuned} "
        "other objects (printed law: the paper's)."
    )
    return table_of_columns("robustness-start", "law", rows, columns, (note,), PAGE)


def measure_outcomes(count: int = COUNT) -> Table:
    """Number of outcomes of the printed law that change with irrelevant changes.

    Args:
        count: Number of objects.
    """
    base = with_law(load_scenario(WORLDS["ideal"]), PRINTED)
    varied = list(vary_objects(base, random_objects(count)))
    held, rows = np.zeros(count, bool), {}
    for words, values in DISTURBANCES.items():
        runs = simulate_many(with_values(scenario, values) for scenario in varied)
        outcomes = np.array([run.metrics.held for run in runs])
        if not values:
            held = outcomes
        changed = format_share(int(np.sum(outcomes != held)), count) if values else "–"
        rows[words] = {
            "held (95 % interval)": format_share(int(outcomes.sum()), count),
            "another outcome than as it is": changed,
        }
    head = f"{PRINTED}, {count} objects, ideal world"
    return table_of_rows("robustness-outcomes", head, rows, page=PAGE)


def _success_map(law: str, sides: np.ndarray) -> np.ndarray:
    """Longest slip path [mm] for each pair of friction coefficients, NaN if an object is lost."""
    pairs = [(1.0, left, right) for right in sides for left in sides]
    runs = simulate_objects(load_scenario(WORLDS["ideal"]), law, np.array(pairs))
    paths = [1e3 * max(r.metrics.slip_path) if r.metrics.held else np.nan for r in runs]
    return np.reshape(paths, (len(sides), len(sides)))


class Sweep(NamedTuple):
    """A setting that is swept up to the failure of the composite law.

    Attributes:
        words: Description of the setting; its last word names the table.
        key: Dotted key of the setting.
        unit: Unit of the displayed numbers, a thousandth of the SI unit.
        values: The displayed numbers.
        bases: Hands and worlds of the sweep, by name.
    """

    words: str
    key: str
    unit: str
    values: tuple[float, ...]
    bases: Mapping[str, Callable[[], Scenario]]


def measure_sweep(sweep: Sweep, count: int = FEWER) -> Table:
    """Fractions held by the composite law and the oracle, with the same objects at every point.

    Args:
        sweep: The swept parameter.
        count: Number of objects.
    """
    points = [{sweep.key: 1e-3 * value} for value in sweep.values]
    columns, failures = {}, []
    for name, make in sweep.bases.items():
        base, found = make(), {}
        for law in ("composite", ORACLE):
            found[law] = [hold_at_best(with_values(base, p), law, 0, count).held for p in points]
            shares = [format_share(held, count) for held in found[law]]
            columns[f"{name}: {law.partition(':')[0]}"] = shares
        held = zip(sweep.values, found["composite"], strict=True)
        lost = [value for value, number in held if number < FAILED * count]
        failures.append(f"{name} at {lost[0]:g} {sweep.unit}" if lost else f"{name} nowhere")
    note = (
        f"{count} objects at every point, with 95 % intervals. The composite law first holds less "
        f"than half: {'; '.join(failures)}."
    )
    table, head = f"robustness-{sweep.words.split()[-1]}", f"{sweep.words} [{sweep.unit}]"
    labels = [f"{value:g}" for value in sweep.values]
    return table_of_columns(table, head, labels, columns, (note,), PAGE)


def _noisy(**values: Any) -> Scenario:
    """The law expects more noise than at any point: one setting for all of them."""
    more = {f"sensing.{key}": value for key, value in values.items()}
    return with_values(load_scenario(WORLDS["noisy"]), {"controller.velocity_noise": 6e-3} | more)


def _three_noisy_fingers() -> Scenario:
    """Three fingers with the sensors and the settings of the noisy world."""
    base, noisy = load_scenario("three-fingers"), _noisy()
    names = ("slip_stop", "force_noise", "velocity_noise")
    tuned = replace(base.controller, **{name: getattr(noisy.controller, name) for name in names})
    return replace(base, controller=tuned, sensing=noisy.sensing)


SWEEPS = (
    Sweep(
        "velocity noise",
        "sensing.velocity_noise",
        "mm/s",
        (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0),
        {
            "two fingers": _noisy,
            "two, slip detected": partial(
                _noisy, true_phases=False, slip_detector="cumulative-sum"
            ),
            "three fingers": _three_noisy_fingers,
        },
    ),
    Sweep(
        "latency",
        "controller.latency",
        "ms",
        (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0),
        {
            "two fingers, ideal": partial(load_scenario, WORLDS["ideal"]),
            "two, noisy": _noisy,
            "three fingers, ideal": partial(load_scenario, "three-fingers"),
        },
    ),
)
