"""Every law in every world: noise, delays, wrong hands and events, with one setting for all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from benchmarks.report import Table, format_share
from benchmarks.robustness import EXACT, INERTIA_PER_MASS, random_objects
from slipgrasp.core.processors import available_processors
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome

COUNT = 1000
DURATION = 3.0  # a grip that is too strong at first is probed for a second
EVENT = 1.5  # when something happens to the object [s]
FIRST_FORCE = 30.0  # normal force of both fingertips at the start [N]
BELIEVED_MASS = 0.5  # at the start [kg]
GRAVITY = 9.81
SAFETY = 1.05

_PAPER = {"controller.velocity_gain": 10.0, **EXACT}
# Every law that is compared: what it sets. A law from elsewhere is one row more.
LAWS: dict[str, dict[str, Any]] = {
    "plain grip": {"controller.kind": "pd-gravity", **_PAPER},
    "grip reflex": {"controller.kind": "grip-reflex", **_PAPER},
    "theorem 3": {"controller.kind": "theorem-3", **_PAPER},
    "theorem 4": {"controller.kind": "theorem-4", **_PAPER},
    "certainty equivalence": {"controller.kind": "certainty-equivalence", **_PAPER},
    "composite": {},
    "oracle": {"estimates": []},
}
# One setting of the composite law for all worlds: it expects more noise than any of them has.
SETTINGS: dict[str, Any] = {
    "controller.grip_safety": SAFETY,
    "controller.grip_force": FIRST_FORCE,
    "controller.slip_stop": 1.5,
    "controller.force_noise": 0.3,
    "controller.velocity_noise": 6e-3,
    "sensing.slip_detector": "cumulative-sum",
}


def _noise(velocity: float) -> dict[str, Any]:
    return {
        "sensing.position_noise": 1e-2 * velocity,
        "sensing.velocity_noise": velocity,
        "sensing.true_accelerations": False,
    }


_LATE = {"controller.latency": 0.03}
_DETECTED = {"sensing.true_phases": False}
_PUSH = {"pulses": [{"time": EVENT, "duration": 0.05, "force": [0.0, -5.0]}]}
WORLDS: dict[str, dict[str, Any]] = {
    "ideal": {},
    "noise 1 mm/s": _noise(1e-3),
    "noise 3 mm/s": _noise(3e-3),
    "noise 5 mm/s": _noise(5e-3),
    "30 ms late": _LATE,
    "40 ms late": {"controller.latency": 0.04},
    "50 ms late": {"controller.latency": 0.05},
    "30 ms late, 3 mm/s": {**_LATE, **_noise(3e-3)},
    "slip detected, 3 mm/s": {**_DETECTED, **_noise(3e-3)},
    "links believed 10 % light": {"controller.link_mass_ratio": 0.9, **_noise(1e-3)},
    "links believed 10 % heavy": {"controller.link_mass_ratio": 1.1, **_noise(1e-3)},
    "links believed 20 % heavy": {"controller.link_mass_ratio": 1.2, **_noise(1e-3)},
    "push, 1 mm/s": {**_PUSH, **_noise(1e-3)},
    "friction falls by 40 %, 1 mm/s": {"friction": 0.6, **_noise(1e-3)},
    "mass grows by half, 1 mm/s": {"mass": 1.5, **_noise(1e-3)},
}


class Held(NamedTuple):
    """How one object fared.

    Attributes:
        held: Whether nothing slips during the last half second.
        kept: Whether the run went to its end, slipping or not.
        path: Of the longer slipping fingertip [m].
        force: Normal force at the end over the least that friction allows; NaN where not held.
    """

    held: bool
    kept: bool
    path: float
    force: float


def measure_worlds(count: int = COUNT) -> list[Table]:
    """What every law holds in every world, and how, for the same objects with two fingers.

    Args:
        count: Number of objects.
    """
    found = {
        world: {law: hold(law, values, count) for law in LAWS} for world, values in WORLDS.items()
    }
    note = (
        f"{count} objects; the first normal force of every law is {FIRST_FORCE:g} N, but that of "
        "the oracle, which is told the truth. Intervals are Wilson's, 95 %."
    )
    shares = tuple(
        (world, *(format_share(sum(run.held for run in runs), count) for runs in laws.values()))
        for world, laws in found.items()
    )
    how = tuple(
        (world, *(_describe(runs) for runs in laws.values())) for world, laws in found.items()
    )
    heads = ("world", *LAWS)
    legend = (
        "Kept in hand [%]; slip path of all runs, median/worst [mm]; normal force at the end over "
        "the least that friction allows, median of the held."
    )
    return [
        Table("robustness-worlds", heads, shares, (note,), "robustness.md"),
        Table("robustness-how", heads, how, (legend,), "robustness.md"),
    ]


def hold(law: str, world: Mapping[str, Any], count: int) -> list[Held]:
    """Lets one law hold the random objects in one world.

    Args:
        law: One of `LAWS`.
        world: One of the values of `WORLDS`.
        count: Number of objects.
    """
    with ThreadPoolExecutor(available_processors()) as pool:
        return list(pool.map(_run, _vary(law, world, count)))


def _vary(law: str, world: Mapping[str, Any], count: int) -> Iterator[Scenario]:
    """Every object in one world, each with noise of its own."""
    friction = SAFETY * BELIEVED_MASS * GRAVITY / (2.0 * FIRST_FORCE)
    believed = {f"estimates.{i}.initial": friction for i in range(2)}
    base = with_values(load_scenario("composite-case-2"), {**SETTINGS, **believed})
    base = with_values(base, LAWS[law])
    for seed, (mass, *frictions) in enumerate(random_objects(count).tolist()):
        values = {
            "object.mass": mass,
            "object.inertia": INERTIA_PER_MASS * mass,
            **{f"fingers.{i}.friction": mu for i, mu in enumerate(frictions)},
            "simulation.seed": seed,
            "simulation.duration": DURATION,
            "simulation.output_rate": 20.0,
            **{key: value for key, value in world.items() if key not in ("friction", "mass")},
        }
        changes = [
            {"time": EVENT, "parameter": f"fingers.{i}.friction", "value": world["friction"] * mu}
            for i, mu in enumerate(frictions)
            if "friction" in world
        ]
        if "mass" in world:
            grown = world["mass"] * mass
            changes = [{"time": EVENT, "parameter": "object.mass", "value": grown}]
        yield with_values(base, {**values, "changes": changes})


def _run(scenario: Scenario) -> Held:
    simulation = Simulation(scenario)
    run_to_end(simulation, lambda _: None)
    result = simulation.result()
    metrics, trace = result.metrics, result.trace
    # Level contacts share the load alike: the one with less friction sets the grip.
    needed = np.sum(np.abs(trace.tangential_force[-1])) / 2.0 / trace.friction_coefficient[-1].min()
    force = float(trace.normal_force[-1].mean() / needed) if metrics.held else np.nan
    kept = result.outcome is Outcome.COMPLETED
    return Held(metrics.held, kept, max(metrics.slip_path), force)


def _describe(runs: list[Held]) -> str:
    paths = 1e3 * np.array([run.path for run in runs])
    kept = 100.0 * np.mean([run.kept for run in runs])
    forces = [run.force for run in runs if run.held]
    force = f"{np.median(forces):.2f}" if forces else "–"
    return f"{kept:.0f}; {np.median(paths):.2f}/{paths.max():.1f}; {force}"
