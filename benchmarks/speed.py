"""Single runs compared with MuJoCo on the same scene, and the parts of our cost."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping

from benchmarks.mujoco_hold import STEP, hold_by_actuators, hold_by_numpy
from benchmarks.report import Table, judge
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

ROUNDS = 15
CASES = ("paper-case-1", "paper-case-2")
CONTROL = {"continuous control": 0.0, "1 kHz control": 0.001}

_ALONE = (10.0, 25.0)  # target and aim of case I, continuous, against MuJoCo alone
_NUMPY = 25.0  # target against MuJoCo with a controller in NumPy

_ENGINE = "MuJoCo, 1 ms, held by its own actuators"
_WITH_NUMPY = "MuJoCo, 1 ms, a PD law in NumPy at every step"


def run() -> list[Table]:
    """The tables ``speed`` and ``profile``."""
    return [compare_speed(), profile()]


def compare_speed(rounds: int = ROUNDS, duration: float = 7.0) -> Table:
    """CPU time of the paper's cases and of MuJoCo, measured in turns.

    Args:
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
    """
    runs = dict(_scenarios(duration))
    heads, rows, ratios = race_mujoco(load_scenario(CASES[0]), runs, rounds, duration)
    return Table("speed", heads, rows, _results(*ratios[f"{CASES[0]}, continuous control"]))


def race_mujoco(
    case: Scenario, runs: Mapping[str, Scenario], rounds: int, duration: float
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...], dict[str, tuple[float, float]]]:
    """CPU time of runs and of MuJoCo holding the object of one at rest, measured in turns.

    Args:
        case: Scenario that MuJoCo holds.
        runs: Our runs by name.
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].

    Returns:
        Heads and rows of a table; for each of our runs, the relative time of MuJoCo without and
        with a law in NumPy.
    """
    works: dict[str, Callable[[], object]] = {
        _ENGINE: hold_by_actuators(case, duration).run,
        _WITH_NUMPY: hold_by_numpy(case, duration).run,
    }
    for words, scenario in runs.items():
        works[words] = lambda scenario=scenario: simulate(scenario)
    seconds = median_seconds(works, rounds)
    peers = (seconds[_ENGINE], seconds[_WITH_NUMPY])
    heads = (f"{duration:g} s of", "CPU [ms]", "MuJoCo / it", "MuJoCo with NumPy / it")
    rows = tuple(_row(name, own, peers) for name, own in seconds.items())
    return (
        heads,
        rows,
        {name: (peers[0] / seconds[name], peers[1] / seconds[name]) for name in runs},
    )


def profile(rounds: int = ROUNDS, duration: float = 7.0) -> Table:
    """Parts of the CPU time of a run: around the kernel, and in it.

    Args:
        rounds: Number of timings of each run.
        duration: Simulated time of every run [s].
    """
    heads, rows = profile_runs(dict(_scenarios(duration)), rounds, duration)
    hold = hold_by_actuators(load_scenario(CASES[0]), duration)
    step = median_seconds({_ENGINE: hold.run}, rounds)[_ENGINE]
    each = 1e6 * step * STEP / duration
    ticks = (
        "A control tick is one evaluation of the law and 1 ms of the plant; "
        f"MuJoCo's step of 1 ms takes {each:.1f} us."
    )
    return Table("profile", heads, rows, (ticks,))


def profile_runs(
    runs: Mapping[str, Scenario], rounds: int, duration: float
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Heads and rows of a table with the parts of the CPU time of runs.

    Args:
        runs: Runs by name.
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
    """
    heads = (f"{duration:g} s of", "set-up [ms]", "kernel [ms]", "trace, metrics [ms]", "tick [us]")
    return heads, tuple((name, *_profile_row(run, rounds)) for name, run in runs.items())


def _scenarios(duration: float) -> Iterator[tuple[str, Scenario]]:
    for name in CASES:
        for words, period in CONTROL.items():
            values = {"controller.control_period": period, "simulation.duration": duration}
            yield f"{name}, {words}", with_values(load_scenario(name), values)


def _row(name: str, own: float, peers: tuple[float, float]) -> tuple[str, ...]:
    return (name, f"{MILLISECONDS * own:.2f}", *(f"{peer / own:.1f}" for peer in peers))


def _results(alone: float, with_numpy: float) -> tuple[str, ...]:
    return (
        f"Case I, continuous control, against MuJoCo alone: {judge(alone, *_ALONE)}.",
        f"Against MuJoCo with the law in NumPy: {judge(with_numpy, _NUMPY)}.",
    )


def _profile_row(scenario: Scenario, rounds: int) -> tuple[str, ...]:
    parts = [_time_parts(scenario) for _ in range(rounds + 1)][1:]
    setup, kernel, result = (statistics.median(part) for part in zip(*parts, strict=True))
    period = scenario.controller.control_period
    tick = f"{1e6 * kernel * period / scenario.simulation.duration:.2f}" if period else ""
    return (*(f"{MILLISECONDS * part:.2f}" for part in (setup, kernel, result)), tick)


def _time_parts(scenario: Scenario) -> tuple[float, float, float]:
    """CPU time of set-up, of the compiled kernel, and of trace and metrics [s]."""
    start = time.process_time()
    simulation = Simulation(scenario)
    ready = time.process_time()
    while not simulation.finished:
        simulation.advance()
    done = time.process_time()
    simulation.result()
    return ready - start, done - ready, time.process_time() - done
