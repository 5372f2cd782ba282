"""Three claims about the composite law, each with the figure that carries or refutes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.report import Table, format_share
from benchmarks.robustness import COUNT, random_objects, vary_objects
from benchmarks.robustness_worlds import (
    SETTINGS,
    WORLDS,
    Held,
    hold,
    load_field_laws,
    noisy_motion,
)
from slipgrasp.core.kernel.compiler import call
from slipgrasp.core.kernel.flow import update_mechanics
from slipgrasp.core.kernel.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.records import make_record
from slipgrasp.core.kernel.run import make_run
from slipgrasp.core.kernel.workspace import WORKSPACE
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

PAGE = "claims.md"
EXPECTED = 0.3  # error of a force that the law expects beside that from noise [N]
SIGMAS = 6.0  # beyond which an error counts as news and what was known is forgotten

LATENCIES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)  # [s]
_BLIND = {**SETTINGS, "controller.prediction": False}
SWITCHES, HOLDS = "switches, K_v 20", "holds, K_v 20"
SWITCHING: dict[str, dict[str, Any]] = {
    "switches, K_v 10": {
        **_BLIND,
        "controller.distribution": "exact",
        "controller.velocity_gain": 10.0,
    },
    "holds, K_v 10": {**_BLIND, "controller.velocity_gain": 10.0},
    SWITCHES: {**_BLIND, "controller.distribution": "exact"},
    HOLDS: _BLIND,
    "holds and looks ahead": SETTINGS,
}
NOISES = (5e-4, 1e-3, 2e-3, 3e-3, 5e-3, 1e-2)  # [m/s]
_UNAWARE = {**SETTINGS, "controller.velocity_noise": 0.0}
_DETECTED = {"sensing.true_phases": False}
UNAWARE_OF_NOISE, AWARE_OF_NOISE = "0.3 N expected", "noise of 6 mm/s expected"
AWARE: dict[str, dict[str, Any]] = {
    UNAWARE_OF_NOISE: _UNAWARE,
    AWARE_OF_NOISE: SETTINGS,
    "0.3 N, slip by threshold": {
        **_UNAWARE,
        **_DETECTED,
        "sensing.slip_detector": "threshold",
    },
    "6 mm/s, slip by sums": {**SETTINGS, **_DETECTED},
}
LATE = {
    "sensing.true_phases": False,
    "sensing.slip_detector": "threshold",
    "sensing.slip_delay": 0.02,
    "controller.latency": 0.017,
}
LATE_WORLDS = (
    "ideal",
    "noise 1 mm/s",
    "noise 3 mm/s",
    "push, 1 mm/s",
    "friction falls by 40 %, 1 mm/s",
    "mass grows by half, 1 mm/s",
)
RIVALS = ("composite", "reactive force")


class Point(NamedTuple):
    """How objects fared in one world.

    Attributes:
        held: How many were held.
        count: Of how many.
        median: Of the slip paths of all runs [m].
        worst: The longest of them [m].
        safety: Least of mu F_n over |F_x| at the end, median of the held; None where it was not
            asked for.
    """

    held: int
    count: int
    median: float
    worst: float
    safety: float | None = None


class Series(NamedTuple):
    """Points of one way of control, in the order of what is swept."""

    name: str
    points: tuple[Point, ...]


def run(docs: Path | None = None) -> list[Table]:
    """The tables ``claim-1`` to ``claim-3`` and ``claim-hands``, and their picture."""
    # Those modules know this one.
    from benchmarks.claims_chart import draw_claims
    from benchmarks.claims_hands import measure_hands, tabulate_hands

    delay, noise = measure_switching(), measure_noise()
    late = measure_late()
    expected = noise_that_fails(load_scenario("composite-case-2"))
    if docs is not None:
        draw_claims(delay, noise, late, expected, docs / "images" / "claims.png")
    return [
        _tabulate("claim-1", "latency [ms]", [1e3 * t for t in LATENCIES], delay),
        _tabulate(
            "claim-2",
            "velocity noise [mm/s]",
            [1e3 * v for v in NOISES],
            noise,
            (
                f"Errors of the object's vertical row reach {EXPECTED:g} N at "
                f"{1e3 * expected:.2f} mm/s, and {SIGMAS:g} times that at "
                f"{1e3 * SIGMAS * expected:.2f} mm/s.",
            ),
        ),
        _tabulate("claim-3", "20 ms to detection and 17 ms late", LATE_WORLDS, late),
        tabulate_hands(measure_hands()),
    ]


def measure_switching(count: int = COUNT) -> list[Series]:
    """Latency with and without a torque that switches on the belief of slip."""
    return [
        _sweep(name, values, [{"controller.latency": t} for t in LATENCIES], count)
        for name, values in SWITCHING.items()
    ]


def measure_noise(count: int = COUNT) -> list[Series]:
    """Velocity noise where the law expects its errors, and where it does not."""
    worlds = [noisy_motion(noise) for noise in NOISES]
    return [_sweep(name, values, worlds, count) for name, values in AWARE.items()]


def measure_late(count: int = COUNT) -> list[Series]:
    """The delays of the field, from a first grip of 30 N, in the worlds of the table."""
    load_field_laws()
    found = []
    for law in RIVALS:
        runs = [hold(law, {**WORLDS[world], **LATE}, count) for world in LATE_WORLDS]
        found.append(Series(law, tuple(map(point_of, runs))))
    return found


def point_of(runs: Sequence[Held]) -> Point:
    """How the objects of one world fared, with how hard they were held at the end."""
    safety = [run.safety for run in runs if run.held]
    point = _point([run.held for run in runs], [run.path for run in runs])
    return point._replace(safety=float(np.median(safety)) if safety else np.nan)


def hold_for_a_second(base: Scenario, count: int) -> Point:
    """Lets the composite law hold the random objects, from a friction believed to be 1.2.

    Args:
        base: Hand, law and world.
        count: Number of objects.
    """
    objects = random_objects(count, len(base.fingers))
    metrics = [run.metrics for run in simulate_many(vary_objects(base, "composite", objects))]
    return _point([m.held for m in metrics], [max(m.slip_path) for m in metrics])


def noise_that_fails(scenario: Scenario) -> float:
    """Velocity noise whose error in the row of the vertical force is what the law expects [m/s].

    A filtered difference of white noise sigma has the deviation sigma / T times
    a sqrt(2 / (2 - a)), a = T / (T_f + T); the row multiplies it by that row of M~.

    Args:
        scenario: Hand, object and filter.
    """
    table = make_table(scenario)
    model, work = pack_model(table, whole_faces()), make_record(WORKSPACE)
    state = make_run(table, keeps_rows=False)[0].step.start
    call(update_mechanics, model, state, work)
    n = model.num_fingers
    xy, yy = work.dynamics.inertia[:n, 1], work.dynamics.inertia[:n, 2]
    rx, ry = work.kin.arms[:n].T
    row = [xy.sum(), model.truth.object_inertia[1] + yy.sum(), (yy * rx - xy * ry).sum()]
    period = scenario.controller.control_period
    whole = scenario.sensing.acceleration_filter_time + period
    per_noise = np.sqrt(2.0 / (2.0 - period / whole)) / whole
    return float(EXPECTED / (per_noise * np.linalg.norm(row)))


def _sweep(
    name: str, values: Mapping[str, Any], worlds: Sequence[Mapping[str, Any]], count: int
) -> Series:
    """One law in every world, for a second."""
    base = with_values(load_scenario("composite-case-2"), values)
    points = (hold_for_a_second(with_values(base, world), count) for world in worlds)
    return Series(name, tuple(points))


def _point(held: Sequence[bool], paths: Sequence[float]) -> Point:
    return Point(sum(held), len(held), float(np.median(paths)), max(paths))


def _tabulate(
    name: str,
    head: str,
    labels: Sequence[float | str],
    series: Sequence[Series],
    notes: tuple[str, ...] = (),
) -> Table:
    rows = tuple(
        (
            label if isinstance(label, str) else f"{label:g}",
            *(describe_point(each.points[k]) for each in series),
        )
        for k, label in enumerate(labels)
    )
    count = series[0].points[0].count
    legend = f"{count} objects: held, with the 95 % interval; slip path, median/worst [mm]"
    if series[0].points[0].safety is not None:
        legend += "; least of mu F_n over |F_x| at the end, median of the held"
    return Table(name, (head, *(each.name for each in series)), rows, (legend + ".", *notes), PAGE)


def describe_point(point: Point) -> str:
    """Held, slip path and, where asked for, how hard, as the legend of `_tabulate` says."""
    share = format_share(point.held, point.count)
    safety = "" if point.safety is None else f"; {point.safety:.2f}"
    return f"{share}; {1e3 * point.median:.2f}/{1e3 * point.worst:.1f}{safety}"
