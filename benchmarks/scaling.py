"""Cost of a run as a function of its duration and of the number of fingers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.hands import holding_hand
from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, fit_exponent, fit_line, median_seconds
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

ROUNDS = 15
DURATIONS = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0)  # [s]
FINGERS = (2, 3, 4, 5, 6)
MAX_EXPONENT = 3.0  # of the cost over the number of fingers
CONTROL = {"continuous": 0.0, "1 kHz": 0.001}


class Scaling(NamedTuple):
    """Cost over size, for both kinds of control.

    Attributes:
        sizes: Durations [s], or numbers of fingers.
        seconds: CPU time of a run of each size [s], by the name of the control.
    """

    sizes: tuple[float, ...]
    seconds: dict[str, list[float]]

    def exponent(self, control: str) -> float:
        """The k of cost ~ size^k."""
        return fit_exponent(self.sizes, self.seconds[control])


def run(docs: Path | None = None) -> list[Table]:
    """The tables ``scaling-duration`` and ``scaling-fingers``, and their diagram."""
    durations, fingers = measure_duration(), measure_fingers()
    if docs is not None:
        from benchmarks.charts import draw_scaling, save

        save(draw_scaling(durations, fingers), docs / "images" / "scaling.svg")
    return [_duration_table(durations), _fingers_table(fingers)]


def measure_duration(durations: Sequence[float] = DURATIONS, rounds: int = ROUNDS) -> Scaling:
    """Cost of the paper's case I over its duration.

    Args:
        durations: Simulated times [s].
        rounds: Number of timings of each run.
    """
    case = load_scenario("paper-case-1")
    scenarios = {
        (control, duration): with_values(
            case, {"controller.control_period": period, "simulation.duration": duration}
        )
        for control, period in CONTROL.items()
        for duration in durations
    }
    return _measure(scenarios, tuple(durations), rounds)


def measure_fingers(
    numbers: Sequence[int] = FINGERS, rounds: int = ROUNDS, duration: float = 7.0
) -> Scaling:
    """Cost of a run over the number of fingers, with unknown masses.

    Args:
        numbers: Numbers of fingers.
        rounds: Number of timings of each run.
        duration: Simulated time of every run [s].
    """
    scenarios = {
        (control, float(number)): with_values(
            holding_hand(number, period), {"simulation.duration": duration}
        )
        for control, period in CONTROL.items()
        for number in numbers
    }
    return _measure(scenarios, tuple(float(number) for number in numbers), rounds)


def _measure(
    scenarios: dict[tuple[str, float], Scenario], sizes: tuple[float, ...], rounds: int
) -> Scaling:
    works = {
        f"{control} {size}": lambda scenario=scenario: simulate(scenario)
        for (control, size), scenario in scenarios.items()
    }
    seconds = median_seconds(works, rounds)
    return Scaling(
        sizes, {control: [seconds[f"{control} {size}"] for size in sizes] for control in CONTROL}
    )


def _duration_table(scaling: Scaling) -> Table:
    notes = [
        f"Under {control} control: {1e3 * line.intercept:.2f} ms plus {1e3 * line.slope:.3f} ms "
        f"per simulated second, within {100.0 * line.deviation:.0f} %."
        for control in CONTROL
        for line in [fit_line(scaling.sizes, scaling.seconds[control])]
    ]
    heads = ("simulated [s]", *_heads())
    return Table("scaling-duration", heads, _rows(scaling), tuple(notes))


def _fingers_table(scaling: Scaling) -> Table:
    exponents = {control: scaling.exponent(control) for control in CONTROL}
    told = " and ".join(f"{k:.2f} ({control})" for control, k in exponents.items())
    outcome = "met" if max(exponents.values()) <= MAX_EXPONENT else "missed"
    note = f"Cost ~ fingers^k, k = {told}; target at most {MAX_EXPONENT:g}: {outcome}."
    return Table("scaling-fingers", ("fingers", *_heads()), _rows(scaling), (note,))


def _heads() -> list[str]:
    return [f"{control} control, CPU [ms]" for control in CONTROL]


def _rows(scaling: Scaling) -> tuple[tuple[str, ...], ...]:
    columns = zip(*scaling.seconds.values(), strict=True)
    return tuple(
        (f"{size:g}", *(f"{MILLISECONDS * cost:.2f}" for cost in costs))
        for size, costs in zip(scaling.sizes, columns, strict=True)
    )
