"""A spatial hand compared with MuJoCo: cost of a run, parts of the cost, and motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numba

from benchmarks.mujoco_replay import replay_in_mujoco
from benchmarks.replay import DURATION, STEPS, measure_differences
from benchmarks.report import Table, met, table_of_columns, table_of_rows
from benchmarks.speed import profile_runs, race_mujoco
from benchmarks.timing import median_seconds
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.spatial.command import spatial_command
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.learning import spatial_learn
from slipgrasp.core.kernel.spatial.selection import spatial_select
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.definition import apply_values
from tests.core.test_chains import as_chains

CASE = "spatial-prism"
ROUNDS = 15
CALLS = 100_000
PAD_RADIUS = 0.015  # [m]

_ALONE = (1.0, 2.0)  # target and aim against MuJoCo alone
_NUMPY = 2.5  # target against MuJoCo with a controller in NumPy
_EVALUATION = 5.0  # target of one evaluation of the plant [us]
_MOMENTS = {"slipping": 0.05, "sticking": 1.0}  # [s]


def run() -> list[Table]:
    """The tables ``space-speed``, ``-profile``, ``-units``, ``-soft``, ``-chain``, ``-mujoco``."""
    return [*measure_cost(), measure_units(), measure_soft(), measure_chain(), measure_motion()]


def measure_cost(rounds: int = ROUNDS, duration: float = 7.0) -> tuple[Table, Table]:
    """CPU time of a run at 1 kHz and of MuJoCo, in turns; and the parts of our cost.

    Args:
        rounds: Number of timings of each.
        duration: Simulated time of every run [s].
    """
    case = with_values(load_scenario(CASE), {"simulation.duration": duration})
    runs = {f"{CASE}, 1 kHz control": case}
    targets = ("Against MuJoCo alone", _ALONE, _NUMPY)
    speed = race_mujoco("space-speed", case, runs, rounds, duration, targets)
    return speed, profile_runs("space-profile", runs, rounds, duration)


def measure_units(calls: int = CALLS) -> Table:
    """CPU time of the parts of a tick, while three contacts slip and while they stick.

    Args:
        calls: Number of calls for each mean.
    """
    found = {words: _time_units(moment, calls) for words, moment in _MOMENTS.items()}
    columns = {
        f"{words} [us]": [f"{time:.2f}" for time in times.values()]
        for words, times in found.items()
    }
    worst = max(times["plant"] for times in found.values())
    outcome = met(worst <= _EVALUATION)
    note = f"The plant takes {worst:.2f} us at most; target {_EVALUATION:g} us: {outcome}."
    labels = found["sticking"]
    return table_of_columns("space-units", f"{CASE}, one call", labels, columns, (note,))


def _time_units(moment: float, calls: int) -> dict[str, float]:
    model, run = _at(load_scenario(CASE), moment)
    held = (model, run.discrete, run.step.start, run.work)
    parts: dict[str, tuple[Any, tuple[Any, ...]]] = {
        "plant": (spatial_plant, held),
        "law": (spatial_command, (model, run.discrete, run.now, run.senses, run.work)),
        "selection of phases": (spatial_select, (*held, run.selection)),
        "rates of the estimates": (spatial_learn, (*held, run.memory)),
    }
    return {part: _time_calls(unit, arguments, calls) for part, (unit, arguments) in parts.items()}


def _at(scenario: Scenario, moment: float) -> tuple[Record, Record]:
    """The model and the run of a scenario that ends at a given time [s]."""
    simulation = Simulation(with_values(scenario, {"simulation.duration": moment}))
    while not simulation.finished:
        simulation.advance()
    return simulation._model, simulation._run


def _time_calls(unit: Any, arguments: tuple[Any, ...], calls: int) -> float:
    """Mean CPU time of a call from compiled code [us]."""
    repeat = _repeated(unit)
    repeat(1, arguments)
    start = time.process_time()
    repeat(calls, arguments)
    return 1e6 * (time.process_time() - start) / calls


def _repeated(unit: Any) -> Callable[[int, tuple[Any, ...]], None]:
    """Calls a unit repeatedly from compiled code, with the same arguments."""

    @numba.njit
    def repeat(count: int, arguments: tuple[Any, ...]) -> None:
        for _ in range(count):
            unit(*arguments)

    return repeat


def measure_soft(calls: int = CALLS // 10, rounds: int = ROUNDS) -> Table:
    """CPU time of the plant with soft and with hard fingertips at the same states, in turns."""
    hard = load_scenario("spatial-composite")
    pair = {"hard": hard, "soft": apply_values(hard, {"fingers.*.pad_radius": PAD_RADIUS})}
    moments = {"slipping": 0.002, "sticking": 0.5}  # [s]
    return _compare_plants("space-soft", pair, 2.0, moments, calls, rounds)


def measure_chain(calls: int = CALLS // 10, rounds: int = ROUNDS) -> Table:
    """CPU time of the plant with its fingers written as chains and in closed form, in turns."""
    closed = load_scenario(CASE)
    pair = {"closed form": closed, "chain": as_chains(closed)}
    return _compare_plants("space-chain", pair, 3.0, _MOMENTS, calls, rounds)


def _compare_plants(
    name: str,
    pair: Mapping[str, Scenario],
    target: float,
    moments: Mapping[str, float],
    calls: int,
    rounds: int,
) -> Table:
    """A table of the CPU time of one call of the plant of two hands, and the ratio.

    Args:
        name: Name of the table.
        pair: The two scenarios; the second is compared with the first.
        target: Largest ratio wanted.
        moments: Times of the states, by what the contacts do then [s].
        calls: Number of calls for the mean of each turn.
        rounds: Number of turns of each.
    """
    repeat, rows, worst = _repeated(spatial_plant), [], 0.0
    first, second = pair
    for words, moment in moments.items():
        states = {kind: _at(scenario, moment) for kind, scenario in pair.items()}
        works = {
            kind: partial(repeat, calls, (model, run.discrete, run.step.start, run.work))
            for kind, (model, run) in states.items()
        }
        times = median_seconds(works, rounds, time.thread_time)
        ratio = times[second] / times[first]
        rows.append((words, *(f"{1e6 * times[kind] / calls:.2f}" for kind in pair), f"{ratio:.2f}"))
        worst = max(worst, ratio)
    note = f"At most {worst:.2f} times as long; target {target:g}: {met(worst <= target)}."
    heads = ("the plant, three contacts", *(f"{kind} [us]" for kind in pair), "ratio")
    return Table(name, heads, tuple(rows), (note,))


def measure_motion(steps: Sequence[float] = STEPS, duration: float = DURATION) -> Table:
    """Deviation of MuJoCo from the run whose torques it uses.

    Args:
        steps: MuJoCo's time steps [s]; the last one is half of the one before.
        duration: Simulated time [s].
    """
    rows = {
        f"{1e3 * row.step:g} ms" if row.step else "0, by the two last": {
            "position [um]": f"{1e6 * row.position:.2f}",
            "turn [urad]": f"{1e6 * row.angle:.2f}",
            "slip [um]": f"{1e6 * row.slip:.2f}",
            "slip in the end [um]": f"{1e6 * row.final_slip:.2f}",
            "ends of slip [us]": f"{1e6 * row.slip_end:.0f}" if row.step else "",
        }
        for row in measure_differences(replay_in_mujoco, CASE, steps, duration)
    }
    return table_of_rows("space-mujoco", f"{CASE}, {duration:g} s in MuJoCo, step", rows)
