"""Cost of a run as a function of its duration and of the number of fingers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from benchmarks.hands import holding_hand
from benchmarks.report import Table, met, table_of_columns
from benchmarks.timing import MILLISECONDS, fit_exponent, fit_line, median_seconds
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

DURATIONS = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0)  # [s]
FINGERS = (2, 3, 4, 5, 6)
MAX_EXPONENT = 3.0  # of the cost over the number of fingers
CONTROL = {"continuous": 0.0, "1 kHz": 0.001}
Costs = dict[str, list[float]]


def run() -> list[Table]:
    """The tables ``scaling-duration`` and ``scaling-fingers``."""
    return [measure_duration(), measure_fingers()]


def measure_duration(durations: Sequence[float] = DURATIONS, rounds: int = 15) -> Table:
    """Cost of the paper's case I over its duration.

    Args:
        durations: Simulated times [s].
        rounds: Number of timings of each run.
    """
    case = load_scenario("paper-case-1")
    keys = "simulation.duration", "controller.control_period"
    costs = _measure(
        lambda *values: with_values(case, dict(zip(keys, values, strict=True))), durations, rounds
    )
    notes = [
        f"Under {control} control: {1e3 * line.intercept:.2f} ms plus {1e3 * line.slope:.3f} ms "
        f"per simulated second, within {100.0 * line.deviation:.0f} %."
        for control, seconds in costs.items()
        for line in [fit_line(durations, seconds)]
    ]
    return _table("scaling-duration", "simulated [s]", durations, costs, notes)


def measure_fingers(
    numbers: Sequence[int] = FINGERS, rounds: int = 15, duration: float = 7.0
) -> Table:
    """Cost of a run over the number of fingers, with unknown masses.

    Args:
        numbers: Numbers of fingers.
        rounds: Number of timings of each run.
        duration: Simulated time of every run [s].
    """
    values = {"simulation.duration": duration}
    costs = _measure(
        lambda number, period: with_values(holding_hand(int(number), period), values),
        numbers,
        rounds,
    )
    exponents = {control: fit_exponent(numbers, seconds) for control, seconds in costs.items()}
    told = " and ".join(f"{k:.2f} ({control})" for control, k in exponents.items())
    outcome = met(max(exponents.values()) <= MAX_EXPONENT)
    note = f"Cost ~ fingers^k, k = {told}; target at most {MAX_EXPONENT:g}: {outcome}."
    return _table("scaling-fingers", "fingers", numbers, costs, [note])


def _measure(
    make: Callable[[float, float], Scenario], sizes: Sequence[float], rounds: int
) -> Costs:
    """CPU time of a run of each size [s], by the kind of control.

    Args:
        make: Makes a scenario from its size and its control period [s].
        sizes: The sizes.
        rounds: Number of timings of each run.
    """
    works = {
        f"{control} {size}": partial(simulate, make(size, period))
        for control, period in CONTROL.items()
        for size in sizes
    }
    seconds = median_seconds(works, rounds)
    return {control: [seconds[f"{control} {size}"] for size in sizes] for control in CONTROL}


def _table(name: str, head: str, sizes: Sequence[float], costs: Costs, notes: list[str]) -> Table:
    columns = {
        f"{control} control, CPU [ms]": [f"{MILLISECONDS * cost:.2f}" for cost in seconds]
        for control, seconds in costs.items()
    }
    return table_of_columns(name, head, [f"{size:g}" for size in sizes], columns, tuple(notes))
