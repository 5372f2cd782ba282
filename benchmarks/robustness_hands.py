"""What laws hold with three fingers, and two of them with four and six."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.hands import holding_hand
from benchmarks.report import Table
from benchmarks.robustness_worlds import (
    COUNT,
    DURATION,
    FIRST_FORCE,
    SETTINGS,
    WORLDS,
    Held,
    describe_share,
    load_field_laws,
    run_objects,
    tabulate_worlds,
    two_fingers,
    vary_objects,
)
from slipgrasp.core.scenario import Estimate, Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

THREE_LAWS = ("plain grip", "grip reflex", "reactive force", "composite", "oracle")
MORE_FINGERS = (4, 6)
FEWER_LAWS = ("plain grip", "composite")
FEWER_WORLDS = (
    "ideal",
    "noise 3 mm/s",
    "30 ms late, 3 mm/s",
    "slip detected, 3 mm/s",
    "links believed 10 % heavy",
    "friction falls by 40 %, 1 mm/s",
    "links believed 10 % long",
    "found after 20 ms, 17 ms late",
)
# Contacts that carry little are pressed by errors of the model more than they hold.
MORE_SETTINGS = {"controller.grip_safety": 1.2, "controller.minimum_normal_force": 10.0}
HOLD_LEGEND = (
    "Kept in hand [%]; longest slip path of all runs, median/worst [mm]; least of mu F_n over "
    "|F_x| at the end, median of the held."
)
Found = Mapping[str, Mapping[str, list[Held]]]


def measure_hands(count: int = COUNT) -> list[Table]:
    """What laws hold with three fingers in every world, and two of them with more in some.

    Args:
        count: Number of objects.
    """
    load_field_laws()
    three = {
        world: {law: hold_by_hand(3, law, values, count) for law in THREE_LAWS}
        for world, values in WORLDS.items()
    }
    more = {
        world: {
            f"{n} fingers: {law}": hold_by_hand(n, law, WORLDS[world], count)
            for n in MORE_FINGERS
            for law in FEWER_LAWS
        }
        for world in FEWER_WORLDS
    }
    return tabulate_hands(three, more)


def tabulate_hands(three: Found, more: Found) -> list[Table]:
    """The tables of what was held.

    Args:
        three: World, law, objects, with three fingers.
        more: The same with more fingers; their number is part of the name of the law.
    """
    (count,) = {len(runs) for laws in three.values() for runs in laws.values()}
    note = (
        f"{count} objects, {DURATION:g} s: held with the 95 % interval. The plain grip, the reflex "
        f"and the reactive force begin with {FIRST_FORCE:g} N, the composite law with what a "
        "friction of 1.2 asks for; the oracle is told the truth."
    )
    return [
        tabulate_worlds("robustness-three", three, describe_share, note),
        tabulate_worlds("robustness-three-how", three, describe_hold, HOLD_LEGEND),
        tabulate_worlds("robustness-hands", more, _describe_both, f"Held; {HOLD_LEGEND}"),
    ]


def hold_by_hand(n: int, law: str, world: Mapping[str, Any], count: int) -> list[Held]:
    """Lets a hand hold the random objects in one world.

    Args:
        n: Number of its fingers.
        law: One of `robustness_worlds.LAWS`.
        world: One of the values of `WORLDS`.
        count: Number of objects.
    """
    return run_objects(vary_objects(hand_of(n), law, world, count))


def describe_hold(runs: list[Held]) -> str:
    """How they were held, as `HOLD_LEGEND` says."""
    kept = 100.0 * np.mean([run.kept for run in runs])
    paths = 1e3 * np.array([run.path for run in runs])
    safety = [run.safety for run in runs if run.held]
    shown = f"{np.median(safety):.2f}" if safety else "–"
    return f"{kept:.0f}; {np.median(paths):.2f}/{paths.max():.1f}; {shown}"


def hand_of(n: int) -> Scenario:
    """Two and three fingers as in their presets; more on the two faces of case II."""
    settings = {**SETTINGS, **MORE_SETTINGS}
    if n == 2:
        return two_fingers()
    if n == 3:
        return with_values(load_scenario("three-fingers"), settings)
    base = load_scenario("composite-case-2")
    unknowns = tuple(
        Estimate(parameter=f"fingers.{i}.friction", initial=1.2, minimum=0.05, maximum=2.0)
        for i in range(n)
    )
    hand = replace(
        base, fingers=holding_hand(n).fingers, estimates=(*unknowns, *base.estimates[2:])
    )
    return with_values(hand, settings)


def _describe_both(runs: list[Held]) -> str:
    return f"{describe_share(runs)}; {describe_hold(runs)}"
