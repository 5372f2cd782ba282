"""Claims about the composite law, each with the result that supports or refutes it.

Both compare the composite law with and without one of its parts; it is compared with
other laws in `benchmarks.robustness_gains`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.report import Table, table_of_columns
from benchmarks.robustness import COUNT, TUNED, hold_at_best
from benchmarks.robustness_gains import Result, describe
from benchmarks.robustness_worlds import MORE_SETTINGS, SETTINGS, hand_of, noisy_motion
from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.planar.flow import update_mechanics
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.planar.run import make_run
from slipgrasp.core.kernel.planar.workspace import WORKSPACE
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

PAGE = "robustness.md"
FEWER = 500  # objects for the choice of gains
EXPECTED = 0.3  # error of a force that the law expects in addition to noise [N]
SIGMAS = 6.0  # larger errors are new information, and the previous estimate is discarded

LATENCIES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05)  # [s]
_SWITCHES = {**SETTINGS, "controller.distribution": "exact"}
_BLIND = {"controller.prediction": False}
SWITCHES, HOLDS = "switches", "holds"
SWITCHING: dict[str, dict[str, Any]] = {
    SWITCHES: {**_SWITCHES, **_BLIND},
    HOLDS: {**SETTINGS, **_BLIND},
    "switches, predicts": _SWITCHES,
    "holds, predicts": SETTINGS,
}
NOISES = (5e-4, 1e-3, 2e-3, 3e-3, 5e-3, 1e-2)  # [m/s]
_UNAWARE = {**SETTINGS, "controller.velocity_noise": 0.0}
_DETECTED = {"sensing.true_phases": False}
UNAWARE_OF_NOISE, AWARE_OF_NOISE = "0.3 N expected", "noise of 6 mm/s expected"
AWARE: dict[str, dict[str, Any]] = {
    UNAWARE_OF_NOISE: _UNAWARE,
    AWARE_OF_NOISE: SETTINGS,
    "0.3 N, slip by threshold": {**_UNAWARE, **_DETECTED, "sensing.slip_detector": "threshold"},
    "6 mm/s, slip by sums": {**SETTINGS, **_DETECTED},
}
LATENCY, NOISE = 0.03, 3e-3  # for more hands [s], [m/s]
_LIGHT, _HEAVY = ({"controller.link_mass_ratio": ratio} for ratio in (0.9, 1.1))
HANDS: dict[str, tuple[int, dict[str, float]]] = {
    "2 fingers": (2, {}),
    "2, links 10 % too light in the model": (2, _LIGHT),
    "2, links 10 % too heavy in the model": (2, _HEAVY),
    "3 fingers": (3, {}),
    "3, links 10 % too light in the model": (3, _LIGHT),
    "3, links 10 % too heavy in the model": (3, _HEAVY),
    "4 fingers": (4, {}),
    "6 fingers": (6, {}),
}
Series = Mapping[str, Sequence[Result]]


def run() -> list[Table]:
    """The tables ``claim-1``, ``claim-2`` and ``claim-hands``."""
    expected = noise_that_fails(load_scenario("composite-case-2"))
    note = (
        f"Errors of the object's vertical row reach {EXPECTED:g} N at {1e3 * expected:.2f} mm/s, "
        f"and {SIGMAS:g} times that at {1e3 * SIGMAS * expected:.2f} mm/s."
    )
    latencies, noises = ([f"{1e3 * x:g}" for x in values] for values in (LATENCIES, NOISES))
    return [
        _tabulate("claim-1", "latency [ms]", latencies, measure_switching()),
        _tabulate("claim-2", "velocity noise [mm/s]", noises, measure_noise(), note),
        _tabulate("claim-hands", "hand", list(HANDS), measure_hands()),
    ]


def measure_switching(count: int = FEWER, tuned: int = TUNED) -> Series:
    """Latency with and without a torque that switches on the phase estimate; best gains."""
    return {
        name: [_hold({**values, "controller.latency": t}, count, tuned) for t in LATENCIES]
        for name, values in SWITCHING.items()
    }


def measure_noise(count: int = COUNT) -> Series:
    """Velocity noise with errors that the law expects, and with larger ones; preset gains."""
    return {
        name: [_hold({**values, **noisy_motion(noise)}, count) for noise in NOISES]
        for name, values in AWARE.items()
    }


def measure_hands(count: int = FEWER, tuned: int = TUNED) -> Series:
    """Both claims with more fingers, and with models that do not match."""
    late, noisy = {"controller.latency": LATENCY}, noisy_motion(NOISE)
    claims = [
        (f"{1e3 * LATENCY:g} ms: {name}", {**SWITCHING[name], **late}, tuned)
        for name in (SWITCHES, HOLDS)
    ]
    claims += [
        (f"{1e3 * NOISE:g} mm/s: {name}", {**AWARE[name], **noisy}, 0)
        for name in (UNAWARE_OF_NOISE, AWARE_OF_NOISE)
    ]
    found: dict[str, list[Result]] = {name: [] for name, _, _ in claims}
    for n, model in HANDS.values():
        base = load_scenario("composite-case-2") if n == 2 else hand_of(n)
        more = {**model, **(MORE_SETTINGS if n > 2 else {})}
        for name, values, tried in claims:
            hand = with_values(base, {**values, **more})
            found[name].append(hold_at_best(hand, "composite", tried, count))
    return found


def _hold(values: Mapping[str, Any], count: int, tuned: int = 0) -> Result:
    """The composite law with two fingers for a second."""
    base = with_values(load_scenario("composite-case-2"), values)
    return hold_at_best(base, "composite", tuned, count)


def noise_that_fails(scenario: Scenario) -> float:
    """Velocity noise whose error in the row of the vertical force equals the expected one [m/s].

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


def _tabulate(name: str, head: str, labels: Sequence[str], series: Series, *notes: str) -> Table:
    columns = {
        column: [f"{describe(p)}; {1e3 * p.median:.2f}/{1e3 * p.worst:.1f}" for p in points]
        for column, points in series.items()
    }
    count = next(iter(series.values()))[0].count
    legend = f"{count} objects: held (95 % interval), gains K_p/K_v; slip path, median/worst [mm]."
    return table_of_columns(name, head, labels, columns, (legend, *notes), PAGE)
