"""Every law in every world: noise, delays, wrong hands and events, with one setting for all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.report import Table, format_share
from benchmarks.robustness import EXACT, INERTIA_PER_MASS, random_objects
from slipgrasp.core.processors import available_processors
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_loading import load_law
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
FIELD_FILE = Path(__file__).parents[1] / "examples" / "laws" / "field.py"
# Laws of the field: their classes, and of which parameters they are told at the start of the run.
FIELD_LAWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "reactive force": ("ReactiveForce", ("object.",)),
    "learnt friction": ("LearntFriction", ("object.",)),
    "observed slip": ("ObservedSlip", ("object.", "fingers.")),
}
# Every law that is compared: what it sets. A law from elsewhere is one row more.
LAWS: dict[str, dict[str, Any]] = {
    "plain grip": {"controller.kind": "pd-gravity", **_PAPER},
    "grip reflex": {"controller.kind": "grip-reflex", **_PAPER},
    "theorem 3": {"controller.kind": "theorem-3", **_PAPER},
    "theorem 4": {"controller.kind": "theorem-4", **_PAPER},
    "certainty equivalence": {"controller.kind": "certainty-equivalence", **_PAPER},
    **{name: {"controller.kind": name.replace(" ", "-")} for name in FIELD_LAWS},
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


def noisy_motion(noise: float) -> dict[str, Any]:
    """What measures motion with so much velocity noise [m/s]."""
    return {
        "sensing.position_noise": 1e-2 * noise,
        "sensing.velocity_noise": noise,
        "sensing.true_accelerations": False,
    }


def _noise(velocity: float) -> dict[str, Any]:
    return {**noisy_motion(velocity), "sensing.force_noise": 1e2 * velocity}


_LATE = {"controller.latency": 0.03}
_DETECTED = {"sensing.true_phases": False}
# Slip as the authors of the reactive force detect it, and the rest of their loop.
_FOUND_LATE = {
    **_DETECTED,
    **_noise(1e-3),
    "sensing.slip_detector": "threshold",  # sums would find a fast slip sooner
    "sensing.slip_delay": 0.0204,
    "sensing.slip_delay_deviation": 0.006,
}
_RUB = {"every finger": {"joint_damping": 0.2, "joint_friction": 0.5}}
_PUSH = {"pulses": [{"time": EVENT, "duration": 0.05, "force": [0.0, -5.0]}]}
# Keys of scenarios, but for three: what friction and mass are multiplied by in mid-run, and what
# holds of every finger.
_NOT_KEYS = ("friction", "mass", "every finger")
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
    "links believed 10 % long": {"controller.link_length_ratio": 1.1, **_noise(1e-3)},
    "links believed 10 % short": {"controller.link_length_ratio": 0.9, **_noise(1e-3)},
    "joints that rub, 1 mm/s": {**_RUB, **_noise(1e-3)},
    "slip found after 20 ms, 1 mm/s": _FOUND_LATE,
    "found after 20 ms, 17 ms late": {**_FOUND_LATE, "controller.latency": 0.017},
    "forces off by 2 N, 1 mm/s": {"sensing.force_bias": [2.0, 2.0], **_noise(1e-3)},
}


class Held(NamedTuple):
    """How one object fared.

    Attributes:
        held: Whether nothing slips during the last half second.
        kept: Whether the run went to its end, slipping or not.
        path: Of the longer slipping fingertip [m].
        force: Normal force at the end over the least that friction allows; NaN where not held.
        safety: Least of mu F_n / |F_x| over the contacts at the end.
    """

    held: bool
    kept: bool
    path: float
    force: float
    safety: float = np.nan


def measure_worlds(count: int = COUNT) -> list[Table]:
    """What every law holds in every world, and how, for the same objects with two fingers.

    Args:
        count: Number of objects.
    """
    load_field_laws()
    found = {
        world: {law: hold(law, values, count) for law in LAWS} for world, values in WORLDS.items()
    }
    return tabulate(found)


def load_field_laws() -> None:
    """Makes the laws of the field known by their names."""
    for name, _ in FIELD_LAWS.values():
        load_law(f"{FIELD_FILE}:{name}")


def tabulate(found: Mapping[str, Mapping[str, list[Held]]]) -> list[Table]:
    """The tables of what was held.

    Args:
        found: World, law, objects.
    """
    (count,) = {len(runs) for laws in found.values() for runs in laws.values()}
    note = (
        f"{count} objects. The first normal force of every law is {FIRST_FORCE:g} N, but that of "
        "the oracle, which is told the truth. The laws of the field are told the mass at the "
        "start, the observer also the friction. Intervals are Wilson's, 95 %."
    )
    legend = (
        "Kept in hand [%]; slip path of all runs, median/worst [mm]; normal force at the end over "
        "the least that friction allows, median of the held."
    )
    return [
        tabulate_worlds("robustness-worlds", found, describe_share, note),
        tabulate_worlds("robustness-how", found, _describe, legend),
    ]


def tabulate_worlds(
    name: str,
    found: Mapping[str, Mapping[str, list[Held]]],
    describe: Callable[[list[Held]], str],
    note: str,
) -> Table:
    """One row per world, one column per law.

    Args:
        name: Of the table.
        found: World, law, objects.
        describe: What a cell says of its runs.
        note: What is to be read with it.
    """
    rows = tuple((world, *map(describe, laws.values())) for world, laws in found.items())
    heads = ("world", *next(iter(found.values())))
    return Table(name, heads, rows, (note,), "robustness.md")


def hold(law: str, world: Mapping[str, Any], count: int) -> list[Held]:
    """Lets one law hold the random objects in one world, with two fingers.

    Args:
        law: One of `LAWS`.
        world: One of the values of `WORLDS`.
        count: Number of objects.
    """
    return run_objects(vary_objects(two_fingers(), law, world, count))


def run_objects(scenarios: Iterable[Scenario]) -> list[Held]:
    """How every one of these runs went."""
    with ThreadPoolExecutor(available_processors()) as pool:
        return list(pool.map(_run, scenarios))


def vary_objects(
    base: Scenario, law: str, world: Mapping[str, Any], count: int
) -> Iterator[Scenario]:
    """Every object in one world, each with noise of its own.

    Args:
        base: The hand, set for the composite law.
        law: One of `LAWS`.
        world: One of the values of `WORLDS`.
        count: Number of objects.
    """
    base = with_values(base, LAWS[law])
    _, told = FIELD_LAWS.get(law, ("", ()))
    for seed, (mass, *frictions) in enumerate(random_objects(count, len(base.fingers)).tolist()):
        truth = {
            "object.mass": mass,
            "object.inertia": INERTIA_PER_MASS * mass,
            **{f"fingers.{i}.friction": mu for i, mu in enumerate(frictions)},
        }
        beliefs = {
            f"estimates.{k}.initial": truth[estimate.parameter]
            for k, estimate in enumerate(base.estimates)
            if estimate.parameter.startswith(told)
        }
        values = {
            **beliefs,
            **truth,
            "simulation.seed": seed,
            "simulation.duration": DURATION,
            "simulation.output_rate": 20.0,
            **_happening(world, mass, frictions),
        }
        yield with_values(base, values)


def describe_share(runs: list[Held]) -> str:
    """The share of what was held, with its interval."""
    return format_share(sum(run.held for run in runs), len(runs))


def _happening(world: Mapping[str, Any], mass: float, frictions: Sequence[float]) -> dict[str, Any]:
    """Values of a scenario in a world, with the changes of this object in mid-run."""
    changes = []
    if "friction" in world:
        changes = [
            {"time": EVENT, "parameter": f"fingers.{i}.friction", "value": world["friction"] * mu}
            for i, mu in enumerate(frictions)
        ]
    if "mass" in world:
        grown = world["mass"] * mass
        changes = [{"time": EVENT, "parameter": "object.mass", "value": grown}]
    of_fingers = {
        f"fingers.{i}.{key}": value
        for key, value in world.get("every finger", {}).items()
        for i in range(len(frictions))
    }
    values = {key: value for key, value in world.items() if key not in _NOT_KEYS}
    return {**values, **of_fingers, "changes": changes}


def two_fingers() -> Scenario:
    """The hand of case II; what it believes of friction is for the first normal force."""
    friction = SAFETY * BELIEVED_MASS * GRAVITY / (2.0 * FIRST_FORCE)
    believed = {f"estimates.{i}.initial": friction for i in range(2)}
    return with_values(load_scenario("composite-case-2"), {**SETTINGS, **believed})


def _run(scenario: Scenario) -> Held:
    simulation = Simulation(scenario)
    run_to_end(simulation, lambda _: None)
    result = simulation.result()
    metrics, trace = result.metrics, result.trace
    # Level contacts share the load alike: the one with less friction sets the grip.
    needed = np.sum(np.abs(trace.tangential_force[-1])) / 2.0 / trace.friction_coefficient[-1].min()
    force = float(trace.normal_force[-1].mean() / needed) if metrics.held else np.nan
    kept = result.outcome is Outcome.COMPLETED
    loads = np.maximum(np.abs(trace.tangential_force[-1]), 1e-9)
    safety = float((trace.friction_coefficient[-1] * trace.normal_force[-1] / loads).min())
    return Held(metrics.held, kept, max(metrics.slip_path), force, safety)


def _describe(runs: list[Held]) -> str:
    paths = 1e3 * np.array([run.path for run in runs])
    kept = 100.0 * np.mean([run.kept for run in runs])
    forces = [run.force for run in runs if run.held]
    force = f"{np.median(forces):.2f}" if forces else "–"
    return f"{kept:.0f}; {np.median(paths):.2f}/{paths.max():.1f}; {force}"
