"""Sweeps of noise and latency up to the failure of the composite law, compared with the oracle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

from benchmarks.report import Table, format_share
from benchmarks.robustness import ORACLE, WORLDS, random_objects, vary_objects
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

COUNT = 300
FAILED = 0.5  # the law fails if it holds less


class Sweep(NamedTuple):
    """A swept setting.

    Attributes:
        name: Name of its table, after ``robustness-``.
        key: Dotted key of the setting.
        words: Description of the setting.
        unit: Unit of the displayed numbers.
        scale: SI value of a displayed number of 1.
        values: The displayed numbers.
        bases: Hands and worlds of the sweep, by name.
    """

    name: str
    key: str
    words: str
    unit: str
    scale: float
    values: tuple[float, ...]
    bases: Mapping[str, Callable[[], Scenario]]


class HeldShares(NamedTuple):
    """Number of objects held by each law, per value of the sweep."""

    composite: list[int]
    oracle: list[int]


class MeasuredSweep(NamedTuple):
    """A sweep, the number of objects at each point, and the numbers held by each base."""

    sweep: Sweep
    num_objects: int
    held: dict[str, HeldShares]


def measure_sweep(sweep: Sweep, count: int = COUNT) -> MeasuredSweep:
    """Simulates the composite law and the oracle with the same objects at every point.

    Args:
        sweep: The swept parameter.
        count: Number of objects.
    """
    held = {}
    for name, make in sweep.bases.items():
        base = make()
        points = [with_values(base, {sweep.key: sweep.scale * value}) for value in sweep.values]
        held[name] = HeldShares(
            [_count_held(point, "composite", count) for point in points],
            [_count_held(point, ORACLE, count) for point in points],
        )
    return MeasuredSweep(sweep, count, held)


def tabulate_sweep(measured: MeasuredSweep) -> Table:
    """One row per point, and the first point at which the law holds less than half."""
    sweep, count = measured.sweep, measured.num_objects
    heads = [f"{sweep.words} [{sweep.unit}]"]
    heads += [f"{name}: {law}" for name in measured.held for law in ("composite", "oracle")]
    rows = tuple(
        (
            f"{value:g}",
            *(format_share(held[k], count) for shares in measured.held.values() for held in shares),
        )
        for k, value in enumerate(sweep.values)
    )
    failures = "; ".join(_failure(measured, name) for name in measured.held)
    note = (
        f"{count} objects at every point, with 95 % intervals. The composite law first holds less "
        f"than half: {failures}."
    )
    return Table(f"robustness-{sweep.name}", tuple(heads), rows, (note,), "robustness.md")


def _count_held(base: Scenario, law: str, count: int) -> int:
    objects = random_objects(count, len(base.fingers))
    return sum(run.metrics.held for run in simulate_many(vary_objects(base, law, objects)))


def _failure(measured: MeasuredSweep, name: str) -> str:
    shares = zip(measured.sweep.values, measured.held[name].composite, strict=True)
    lost = [value for value, held in shares if held < FAILED * measured.num_objects]
    where = f"at {lost[0]:g} {measured.sweep.unit}" if lost else "nowhere"
    return f"{name} {where}"


def _noisy() -> Scenario:
    """The law expects more noise than at any point: one setting for all of them."""
    return with_values(load_scenario(WORLDS["noisy"]), {"controller.velocity_noise": 6e-3})


def _detected() -> Scenario:
    """The noisy world with detection of slip by cumulative sums."""
    detected = {"sensing.true_phases": False, "sensing.slip_detector": "cumulative-sum"}
    return with_values(_noisy(), detected)


def _ideal() -> Scenario:
    return load_scenario(WORLDS["ideal"])


def _three_fingers() -> Scenario:
    return load_scenario("three-fingers")


def _three_noisy_fingers() -> Scenario:
    """Three fingers with the sensors and the settings of the noisy world."""
    base, noisy = _three_fingers(), _noisy()
    own, law = base.controller, noisy.controller
    tuned = replace(
        own,
        slip_stop=law.slip_stop,
        force_noise=law.force_noise,
        velocity_noise=law.velocity_noise,
    )
    return replace(base, controller=tuned, sensing=noisy.sensing)


SWEEPS = (
    Sweep(
        "noise",
        "sensing.velocity_noise",
        "velocity noise",
        "mm/s",
        1e-3,
        (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0),
        {
            "two fingers": _noisy,
            "two, slip detected": _detected,
            "three fingers": _three_noisy_fingers,
        },
    ),
    Sweep(
        "latency",
        "controller.latency",
        "latency",
        "ms",
        1e-3,
        (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0),
        {
            "two fingers, ideal": _ideal,
            "two, noisy": _noisy,
            "three fingers, ideal": _three_fingers,
        },
    ),
)
