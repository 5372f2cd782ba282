"""Laws, worlds and random objects of the comparison, and its runs.

A world is noise, delay, model mismatch or an event. Every law has the same settings in all worlds,
except for the gains of its tracking controller and prediction (`benchmarks.robustness_gains`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from benchmarks.hands import holding_hand
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Estimate, Scenario
from slipgrasp.core.scenario.law_loading import load_law
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.definition import apply_values, expand_key
from slipgrasp.core.trace.types import Outcome

SEED = 20
MASS, FRICTION = (0.5, 2.0), (0.15, 0.6)
INERTIA_PER_MASS = 0.01042
DURATION = 3.0  # [s], of which one for probing a grip that is initially too strong
EVENT = 1.5  # time of an event [s]
FIRST_FORCE = 30.0  # normal force of both fingertips at the start [N]
ESTIMATED_MASS = 0.5  # at the start [kg]
GRAVITY = 9.81
SAFETY = 1.05
FIRST_FRICTION = SAFETY * ESTIMATED_MASS * GRAVITY / (2.0 * FIRST_FORCE)  # gives that force

EXACT = {"controller.distribution": "exact", "controller.prediction": False}
PUBLISHED_FILE = Path(__file__).parents[1] / "examples" / "laws" / "field.py"
# Published laws: their classes, and the parameters known from the start of the run.
PUBLISHED_LAWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "reactive force": ("ReactiveForce", ("object.",)),
    "learnt friction": ("LearntFriction", ("object.",)),
    "observed slip": ("ObservedSlip", ("object.", "fingers.")),
}
# Settings of every compared law. A custom law is one more row.
LAWS: dict[str, dict[str, Any]] = {
    "plain grip": {"controller.kind": "pd-gravity", **EXACT},
    "grip reflex": {"controller.kind": "grip-reflex", **EXACT},
    "theorem 3": {"controller.kind": "theorem-3", **EXACT},
    "theorem 4": {"controller.kind": "theorem-4", **EXACT},
    "certainty equivalence": {"controller.kind": "certainty-equivalence", **EXACT},
    **{name: {"controller.kind": name.replace(" ", "-")} for name in PUBLISHED_LAWS},
    "composite": {},
    "oracle": {"estimates": []},
}
# One setting of the composite law for all worlds: it expects more noise than in any of them.
SETTINGS: dict[str, Any] = {
    "controller.grip_safety": SAFETY,
    "controller.grip_force": FIRST_FORCE,
    "controller.slip_stop": 1.5,
    "controller.force_noise": 0.3,
    "controller.velocity_noise": 6e-3,
    "sensing.slip_detector": "cumulative-sum",
}
# Errors of the model load weak contacts by more than their normal forces allow.
MORE_SETTINGS = {"controller.grip_safety": 1.2, "controller.minimum_normal_force": 10.0}


def noisy_motion(noise: float) -> dict[str, Any]:
    """Sensors of motion with a velocity noise [m/s]."""
    return {
        "sensing.position_noise": 1e-2 * noise,
        "sensing.velocity_noise": noise,
        "sensing.true_accelerations": False,
    }


def _noise(velocity: float) -> dict[str, Any]:
    return {**noisy_motion(velocity), "sensing.force_noise": 1e2 * velocity}


_DETECTED = {"sensing.true_phases": False}
# Detection of slip as by the authors of the reactive force, and the rest of their loop.
_DELAYED = {
    **_DETECTED,
    **_noise(1e-3),
    "sensing.slip_detector": "threshold",  # sums would detect a fast slip earlier
    "sensing.slip_delay": 0.0204,
    "sensing.slip_delay_deviation": 0.006,
}
_LOOP = {**_DELAYED, "controller.latency": 0.017}
_JOINTS = {"fingers.*.joint_damping": 0.2, "fingers.*.joint_friction": 0.5}
_PUSH = {"pulses": [{"time": EVENT, "duration": 0.05, "force": [0.0, -5.0]}]}
FACTORS = "factors"
_LESS_FRICTION = {FACTORS: {"fingers.*.friction": 0.6}}
# Keys as in a study, and factors of some values at the event.
WORLDS: dict[str, dict[str, Any]] = {
    "ideal": {},
    "noise 1 mm/s": _noise(1e-3),
    "noise 3 mm/s": _noise(3e-3),
    "noise 5 mm/s": _noise(5e-3),
    "slip detected, noise 3 mm/s": {**_DETECTED, **_noise(3e-3)},
    "slip detected after 20 ms": _DELAYED,
    "force bias 2 N": {"sensing.force_bias": [2.0, 2.0], **_noise(1e-3)},
    "model: links 10 % too light": {"controller.link_mass_ratio": 0.9, **_noise(1e-3)},
    "model: links 10 % too heavy": {"controller.link_mass_ratio": 1.1, **_noise(1e-3)},
    "model: links 20 % too heavy": {"controller.link_mass_ratio": 1.2, **_noise(1e-3)},
    "model: links 10 % too short": {"controller.link_length_ratio": 0.9, **_noise(1e-3)},
    "model: links 10 % too long": {"controller.link_length_ratio": 1.1, **_noise(1e-3)},
    "joint friction": {**_JOINTS, **_noise(1e-3)},
    "push": {**_PUSH, **_noise(1e-3)},
    "friction falls by 40 %": {**_LESS_FRICTION, **_noise(1e-3)},
    "mass grows by 50 %": {FACTORS: {"object.mass": 1.5}, **_noise(1e-3)},
    "latency 30 ms": {"controller.latency": 0.03},
    "latency 40 ms": {"controller.latency": 0.04},
    "latency 50 ms": {"controller.latency": 0.05},
    "latency 30 ms, noise 3 mm/s": {"controller.latency": 0.03, **_noise(3e-3)},
    "detected after 20 ms, latency 17 ms": _LOOP,
    "the same, friction falls by 40 %": {**_LOOP, **_LESS_FRICTION},
}
LATE = tuple(world for world, values in WORLDS.items() if "controller.latency" in values)


class Held(NamedTuple):
    """Result of one object.

    Attributes:
        held: True if the run completed without slip during the last half second.
        kept: True if the run completed, slipping or not.
        path: Longest slip path of a fingertip [m].
        safety: Smallest mu F_n / |F_x| over the contacts at the end.
    """

    held: bool
    kept: bool
    path: float
    safety: float = np.nan


def load_published_laws() -> None:
    """Registers the published laws by their names."""
    for name, _ in PUBLISHED_LAWS.values():
        load_law(f"{PUBLISHED_FILE}:{name}")


def random_objects(count: int, fingers: int = 2, seed: int = SEED) -> np.ndarray:
    """Mass [kg] and friction coefficients, uniform and independent: ``(count, 1 + fingers)``."""
    low, high = np.array([MASS, *[FRICTION] * fingers]).T
    return np.random.default_rng(seed).uniform(low, high, (count, 1 + fingers))


def vary_objects(
    base: Scenario,
    objects: np.ndarray,
    seed: int = SEED,
    more: Callable[[dict[str, float]], dict[str, Any]] = lambda truth: {},
) -> Iterator[Scenario]:
    """One run per object, each with separate noise, of a second by default.

    Args:
        base: Hand, law, motion and sensors.
        objects: Mass and friction coefficients, ``(objects, 1 + fingers)``.
        seed: Seed of their draw.
        more: Further values of a scenario, given those of its object.
    """
    for k, (mass, *frictions) in enumerate(objects.tolist()):
        truth = {
            "object.mass": mass,
            "object.inertia": INERTIA_PER_MASS * mass,
            **{f"fingers.{i}.friction": mu for i, mu in enumerate(frictions)},
        }
        # Every object of every draw has a different noise.
        noise = {"simulation.seed": k + 10**6 * (seed - SEED), "simulation.duration": 1.0}
        yield apply_values(base, {**truth, **noise, **more(truth)})


def runs_in_world(
    base: Scenario,
    law: str,
    world: str,
    count: int,
    *,
    tuned: Mapping[str, Any] = MappingProxyType({}),
    seed: int = SEED,
) -> Iterator[Scenario]:
    """Runs of every object in one world.

    Args:
        base: The hand, set for the composite law.
        law: One of `LAWS`.
        world: One of `WORLDS`.
        count: Number of objects.
        tuned: Keys and values chosen for this law in this world.
        seed: Seed of the draw of the objects.
    """
    base = with_values(base, {**LAWS[law], **tuned})
    _, known = PUBLISHED_LAWS.get(law, ("", ()))
    rates = {"simulation.duration": DURATION, "simulation.output_rate": 20.0}
    settings = {key: value for key, value in WORLDS[world].items() if key != FACTORS}
    factors = WORLDS[world].get(FACTORS, {})

    def more(truth: dict[str, float]) -> dict[str, Any]:
        initial = {
            f"estimates.{k}.initial": truth[estimate.parameter]
            for k, estimate in enumerate(base.estimates)
            if estimate.parameter.startswith(known)
        }
        changes = [
            {"time": EVENT, "parameter": key, "value": factor * truth[key]}
            for pattern, factor in factors.items()
            for key in expand_key(base, pattern)
        ]
        return {**initial, **rates, **settings, "changes": changes}

    return vary_objects(base, random_objects(count, len(base.fingers), seed), seed, more)


def hand_of(n: int) -> Scenario:
    """Two and three fingers as in their presets; more fingers on the two faces of case II.

    Two fingers have the friction estimate that gives the first normal force.
    """
    base = load_scenario("three-fingers" if n == 3 else "composite-case-2")
    if n == 2:
        estimates = {f"estimates.{i}.initial": FIRST_FRICTION for i in range(2)}
        return with_values(base, {**SETTINGS, **estimates})
    if n > 3:
        unknowns = tuple(
            Estimate(parameter=f"fingers.{i}.friction", initial=1.2, minimum=0.05, maximum=2.0)
            for i in range(n)
        )
        estimates = (*unknowns, *base.estimates[2:])
        base = replace(base, fingers=holding_hand(n).fingers, estimates=estimates)
    return with_values(base, {**SETTINGS, **MORE_SETTINGS})


def run_object(scenario: Scenario) -> Held:
    """Simulates one object and measures how it was held."""
    simulation = Simulation(scenario)
    run_to_end(simulation, lambda _: None)
    result = simulation.result()
    metrics, trace = result.metrics, result.trace
    kept = result.outcome is Outcome.COMPLETED
    loads = np.maximum(np.abs(trace.tangential_force[-1]), 1e-9)
    safety = float((trace.friction_coefficient[-1] * trace.normal_force[-1] / loads).min())
    return Held(metrics.held, kept, max(metrics.slip_path), safety)
