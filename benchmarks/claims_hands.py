"""The three claims put to two, three, four and six fingers, and to wrong models of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from benchmarks.claims import (
    AWARE,
    AWARE_OF_NOISE,
    HOLDS,
    LATE,
    PAGE,
    RIVALS,
    SWITCHES,
    SWITCHING,
    UNAWARE_OF_NOISE,
    Point,
    describe_point,
    hold_for_a_second,
    point_of,
)
from benchmarks.report import Table
from benchmarks.robustness import COUNT
from benchmarks.robustness_hands import MORE_SETTINGS, hand_of
from benchmarks.robustness_worlds import (
    WORLDS,
    load_field_laws,
    noisy_motion,
    run_objects,
    vary_objects,
)
from slipgrasp.core.scenario.loading import load_scenario, with_values

_LIGHT, _HEAVY = ({"controller.link_mass_ratio": ratio} for ratio in (0.9, 1.1))
HANDS: dict[str, tuple[int, dict[str, float]]] = {
    "2 fingers": (2, {}),
    "2, links believed 10 % light": (2, _LIGHT),
    "2, links believed 10 % heavy": (2, _HEAVY),
    "3 fingers": (3, {}),
    "3, links believed 10 % light": (3, _LIGHT),
    "3, links believed 10 % heavy": (3, _HEAVY),
    "4 fingers": (4, {}),
    "6 fingers": (6, {}),
}
LATENCY, NOISE = 0.03, 3e-3  # of the first and the second claim [s], [m/s]
_LATENCY = {"controller.latency": LATENCY}
_NOISE = noisy_motion(NOISE)
_WAYS: dict[str, dict[str, Any]] = {
    f"{1e3 * LATENCY:g} ms: switches": {**SWITCHING[SWITCHES], **_LATENCY},
    f"{1e3 * LATENCY:g} ms: holds": {**SWITCHING[HOLDS], **_LATENCY},
    f"{1e3 * NOISE:g} mm/s: {UNAWARE_OF_NOISE}": {**AWARE[UNAWARE_OF_NOISE], **_NOISE},
    f"{1e3 * NOISE:g} mm/s: {AWARE_OF_NOISE}": {**AWARE[AWARE_OF_NOISE], **_NOISE},
}
Found = Mapping[str, Mapping[str, Point]]


def measure_hands(count: int = COUNT) -> Found:
    """How the objects fared: hand, claim.

    Args:
        count: Number of objects.
    """
    load_field_laws()
    return {name: {claim: fare(count) for claim, fare in _claims(name)} for name in HANDS}


def tabulate_hands(found: Found) -> Table:
    """One row per hand, two columns per claim."""
    (count,) = {point.count for points in found.values() for point in points.values()}
    rows = tuple(
        (name, *(describe_point(point) for point in points.values()))
        for name, points in found.items()
    )
    note = (
        f"{count} objects: held, with the 95 % interval; slip path, median/worst [mm]; for the "
        "third claim least of mu F_n over |F_x| at the end, median of the held."
    )
    return Table("claim-hands", ("hand", *next(iter(found.values()))), rows, (note,), PAGE)


def _claims(name: str) -> list[tuple[str, Callable[[int], Point]]]:
    """What each column asks of a hand, given the number of objects."""
    n, model = HANDS[name]
    preset = load_scenario("composite-case-2") if n == 2 else hand_of(n)
    more = MORE_SETTINGS if n > 2 else {}

    def for_a_second(values: Mapping[str, Any]) -> Callable[[int], Point]:
        return lambda count: hold_for_a_second(
            with_values(preset, {**values, **more, **model}), count
        )

    def at_the_delays_of_the_field(law: str) -> Callable[[int], Point]:
        world = {**WORLDS["noise 1 mm/s"], **LATE, **model}
        return lambda count: point_of(run_objects(vary_objects(hand_of(n), law, world, count)))

    seconds = [(claim, for_a_second(values)) for claim, values in _WAYS.items()]
    return [*seconds, *((f"late: {law}", at_the_delays_of_the_field(law)) for law in RIVALS)]
