"""What the composite law and a plain grip hold with three, four and six fingers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.hands import holding_hand
from benchmarks.report import Table, format_share
from benchmarks.robustness import INERTIA_PER_MASS, random_objects
from benchmarks.robustness_worlds import (
    DURATION,
    FIRST_FORCE,
    LAWS,
    MORE_WORLDS,
    SETTINGS,
    WORLDS,
    Held,
    happening,
    run_objects,
)
from slipgrasp.core.scenario import Estimate, Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

COUNT = 40
HANDS = (3, 4, 6)
HAND_LAWS = ("plain grip", "composite")
# Contacts that carry little are pressed by errors of the model more than they hold.
HAND_SETTINGS = {
    **SETTINGS,
    "controller.grip_safety": 1.2,
    "controller.minimum_normal_force": 10.0,
}
HAND_WORLDS = {
    name: (WORLDS | MORE_WORLDS)[name]
    for name in (
        "ideal",
        "noise 3 mm/s",
        "30 ms late, 3 mm/s",
        "slip detected, 3 mm/s",
        "links believed 10 % heavy",
        "links believed 10 % long",
        "friction falls by 40 %, 1 mm/s",
    )
}


def measure_hands(count: int = COUNT) -> Table:
    """What two laws hold in every world with more fingers.

    Args:
        count: Number of objects.
    """
    rows = []
    for world, values in HAND_WORLDS.items():
        cells = [describe(hold_by_hand(n, law, values, count)) for n in HANDS for law in HAND_LAWS]
        rows.append((world, *cells))
    heads = ("world", *(f"{n} fingers: {law}" for n in HANDS for law in HAND_LAWS))
    return Table("robustness-hands", heads, tuple(rows), (hands_note(count),), "robustness.md")


def hands_note(count: int) -> str:
    """What the cells say, of so many objects."""
    return (
        f"{count} objects, {DURATION:g} s: held with the 95 % interval; kept in hand [%]; longest "
        "slip path of all runs, median [mm]; least of mu F_n over |F_x| at the end, median of the "
        f"held. The plain grip begins with {FIRST_FORCE:g} N, the composite law with a friction of "
        "1.2 and the settings of more than two fingers."
    )


def hold_by_hand(n: int, law: str, world: Mapping[str, Any], count: int) -> list[Held]:
    """Lets a hand hold the random objects in one world.

    Args:
        n: Number of its fingers.
        law: One of `HAND_LAWS`.
        world: One of the values of `WORLDS`.
        count: Number of objects.
    """
    return run_objects(_vary(n, law, world, count))


def describe(runs: list[Held]) -> str:
    """What the cells of the table say."""
    held = format_share(sum(run.held for run in runs), len(runs))
    kept = 100.0 * np.mean([run.kept for run in runs])
    path = 1e3 * np.median([run.path for run in runs])
    safety = [run.safety for run in runs if run.held]
    shown = f"{np.median(safety):.2f}" if safety else "–"
    return f"{held}; {kept:.0f}; {path:.2f}; {shown}"


def _vary(n: int, law: str, world: Mapping[str, Any], count: int) -> Iterator[Scenario]:
    base = with_values(_hand(n), {**HAND_SETTINGS, **LAWS[law]})
    rubbing = {key: value for key, value in world.items() if key.startswith("fingers.0.")}
    for seed, (mass, *frictions) in enumerate(random_objects(count, n).tolist()):
        yield with_values(
            base,
            {
                "object.mass": mass,
                "object.inertia": INERTIA_PER_MASS * mass,
                **{f"fingers.{i}.friction": mu for i, mu in enumerate(frictions)},
                "simulation.seed": seed,
                "simulation.duration": DURATION,
                "simulation.output_rate": 20.0,
                **happening(world, mass, frictions),
                **{
                    key.replace("fingers.0.", f"fingers.{i}."): value
                    for key, value in rubbing.items()
                    for i in range(n)
                },
            },
        )


def _hand(n: int) -> Scenario:
    """Three fingers as in their preset; more on the two faces of case II."""
    if n == HANDS[0]:
        return load_scenario("three-fingers")
    base = load_scenario("composite-case-2")
    unknowns = tuple(
        Estimate(parameter=f"fingers.{i}.friction", initial=1.2, minimum=0.05, maximum=2.0)
        for i in range(n)
    )
    fingers = holding_hand(n).fingers
    return replace(base, fingers=fingers, estimates=(*unknowns, *base.estimates[2:]))
