"""Single runs compared with MuJoCo on the same scene, and the parts of our cost."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

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


def run() -> list[Table]:
    """The tables ``speed`` and ``profile``."""
    return [compare_speed(), profile()]


def compare_speed(rounds: int = ROUNDS, duration: float = 7.0) -> Table:
    """CPU time of the paper's cases and of MuJoCo, measured in turns.

    Args:
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
    """
    about = "Case I, continuous control, against MuJoCo alone"
    case, runs = load_scenario(CASES[0]), dict(_scenarios(duration))
    return race_mujoco("speed", case, runs, rounds, duration, (about, _ALONE, _NUMPY))


def race_mujoco(
    name: str,
    case: Scenario,
    runs: Mapping[str, Scenario],
    rounds: int,
    duration: float,
    targets: tuple[str, tuple[float, float], float],
) -> Table:
    """CPU time of runs and of MuJoCo holding the object of one at rest, measured in turns.

    Args:
        name: Name of the table.
        case: Scenario that MuJoCo holds.
        runs: Our runs by name.
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
        targets: Start of the note about the first run; target and aim of its time relative to
            MuJoCo alone; target relative to MuJoCo with a law in NumPy.
    """
    works: dict[str, Callable[[], object]] = {
        "MuJoCo, 1 ms, held by its own actuators": hold_by_actuators(case, duration).run,
        "MuJoCo, 1 ms, a PD law in NumPy at every step": hold_by_numpy(case, duration).run,
    }
    works |= {words: partial(simulate, scenario) for words, scenario in runs.items()}
    seconds = median_seconds(works, rounds)
    own = np.array(list(seconds.values()))
    ratios = own[:2] / own[:, None]
    rows = tuple(
        (words, f"{MILLISECONDS * own:.2f}", *(f"{ratio:.1f}" for ratio in pair))
        for (words, own), pair in zip(seconds.items(), ratios, strict=True)
    )
    about, alone, with_numpy = targets
    notes = (
        f"{about}: {judge(ratios[2, 0], *alone)}.",
        f"Against MuJoCo with the law in NumPy: {judge(ratios[2, 1], with_numpy)}.",
    )
    heads = (f"{duration:g} s of", "CPU [ms]", "MuJoCo / it", "MuJoCo with NumPy / it")
    return Table(name, heads, rows, notes)


def profile(rounds: int = ROUNDS, duration: float = 7.0) -> Table:
    """Parts of the CPU time of a run: around the kernel, and in it.

    Args:
        rounds: Number of timings of each run.
        duration: Simulated time of every run [s].
    """
    hold = hold_by_actuators(load_scenario(CASES[0]), duration)
    step = median_seconds({"": hold.run}, rounds)[""]
    ticks = (
        "A control tick is one evaluation of the law and 1 ms of the plant; "
        f"MuJoCo's step of 1 ms takes {1e6 * step * STEP / duration:.1f} us."
    )
    return profile_runs("profile", dict(_scenarios(duration)), rounds, duration, ticks)


def profile_runs(
    name: str, runs: Mapping[str, Scenario], rounds: int, duration: float, *notes: str
) -> Table:
    """A table with the parts of the CPU time of runs.

    Args:
        name: Name of the table.
        runs: Runs by name.
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
        *notes: Sentences below the table.
    """
    heads = (f"{duration:g} s of", "set-up [ms]", "kernel [ms]", "trace, metrics [ms]", "tick [us]")
    rows = tuple((words, *_profile_row(run, rounds)) for words, run in runs.items())
    return Table(name, heads, rows, notes)


def _scenarios(duration: float) -> Iterator[tuple[str, Scenario]]:
    for name in CASES:
        for words, period in CONTROL.items():
            values = {"controller.control_period": period, "simulation.duration": duration}
            yield f"{name}, {words}", with_values(load_scenario(name), values)


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
