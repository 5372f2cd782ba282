"""Sampled control: accuracy and cost of whole runs, with adaptive order and with order 5.

The reference of each case is its run at the tightest tolerance with several steps per tick.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.kernel.numerics.methods import BS32, DOPRI5, RK43
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

PERIOD = 0.001  # [s]
CASES = ("paper-case-1", "paper-case-2", "composite-case-2", "three-fingers")
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
METHODS = {"order chosen": (BS32, RK43, DOPRI5), "order 5": (DOPRI5,)}

_TRUE = {
    "simulation.relative_tolerance": 1e-12,
    "simulation.absolute_tolerance": 1e-14,
    "simulation.max_step": 3.1e-4,
}


def run() -> list[Table]:
    """The table ``sampled``."""
    rows = tuple(row for case in CASES for row in measure(case))
    heads = ("7 s at 1 kHz, tolerance", "CPU [ms]", "pose [m, rad]", "events [s]")
    return [Table("sampled", heads, rows)]


def measure(case: str, rounds: int = 9, duration: float = 7.0) -> list[tuple[str, ...]]:
    """Rows of all tolerances of one case, both methods in turns.

    Args:
        case: The preset.
        rounds: Number of timings of each.
        duration: Simulated time [s].
    """
    truth = simulate(_scenario(case, duration, _TRUE))
    works, errors = {}, {}
    for way, methods in METHODS.items():
        for tolerance in TOLERANCES:
            values = {
                "simulation.relative_tolerance": tolerance,
                "simulation.absolute_tolerance": max(0.01 * tolerance, 1e-14),
            }
            name = f"{case}, {way}, {tolerance:g}"
            works[name] = partial(_simulate_with, methods, _scenario(case, duration, values))
            errors[name] = _judge(works[name](), truth)
    seconds = median_seconds(works, rounds)
    return [
        (name, f"{MILLISECONDS * seconds[name]:.2f}", *(f"{error:.0e}" for error in found))
        for name, found in errors.items()
    ]


def _scenario(case: str, duration: float, values: dict[str, float]) -> Scenario:
    common = {"controller.control_period": PERIOD, "simulation.duration": duration}
    return with_values(load_scenario(case), {**common, **values})


def _simulate_with(methods: tuple[np.void, ...], scenario: Scenario) -> RunResult:
    """A run with only these methods for short steps."""
    simulation = Simulation(scenario)
    model = simulation._model
    model.num_methods = len(methods)
    for rank, method in enumerate(methods):
        model.methods[rank] = method
    while not simulation.finished:
        simulation.advance()
    return simulation.result()


def _judge(result: RunResult, truth: RunResult) -> tuple[float, float]:
    """Largest errors of the final object pose [m, rad] and of the time of a phase change [s]."""
    pose = float(np.abs(result.trace.object_pose[-1] - truth.trace.object_pose[-1]).max())
    if len(result.phase_changes) != len(truth.phase_changes):
        return pose, float("nan")
    pairs = zip(result.phase_changes, truth.phase_changes, strict=True)
    return pose, max(abs(one.time - other.time) for one, other in pairs)
