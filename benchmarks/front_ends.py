"""Cost per control tick of a law in every front end, and of MuJoCo with a controller in Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.mujoco_hold import STEP, hold_by_actuators, hold_by_numpy
from benchmarks.report import Table
from benchmarks.timing import median_seconds
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import load_law
from slipgrasp.core.scenario.loading import load_scenario, with_values

MICROSECONDS = 1e6
FILE = Path(__file__).parents[1] / "examples" / "laws" / "pd_gravity.py"
BUILT_IN = "built in"


def run(rounds: int = 15, duration: float = 7.0) -> list[Table]:
    """The table ``front-ends``: CPU time of a tick at 1 kHz, also of MuJoCo with a law.

    Args:
        rounds: Number of timings of each, in turns.
        duration: Simulated time of every run [s].
    """
    base = with_values(
        with_law(load_scenario("composite-case-2"), "pd-gravity"),
        {"simulation.duration": duration, "controller.control_period": STEP},
    )
    works = {BUILT_IN: lambda: simulate(base)} | _custom_laws(base)
    case = load_scenario("paper-case-1")
    works["MuJoCo, 1 ms, its own actuators"] = hold_by_actuators(case, duration).run
    works["MuJoCo, 1 ms, a PD law in NumPy at every step"] = hold_by_numpy(case, duration).run
    seconds = median_seconds(works, rounds, time.process_time)
    ticks = duration / STEP
    rows = tuple(
        (name, f"{MICROSECONDS * own / ticks:.2f}", f"{own / seconds[BUILT_IN]:.1f}")
        for name, own in seconds.items()
    )
    heads = (f"{duration:g} s of pd-gravity at 1 kHz", "CPU per tick [us]", "times built in")
    note = f"Median of {rounds} rounds in turns, the plant and the trace included."
    return [Table("front-ends", heads, rows, (note,), "laws.md")]


def _custom_laws(base: Scenario) -> dict[str, Callable[[], object]]:
    """The same law through every front end."""
    works: dict[str, Callable[[], object]] = {}
    for words, name in (("compiled", "CompiledPdGravity"), ("Python", "PdGravity")):
        law = load_law(f"{FILE}:{name}")
        scenario = with_values(base, {"controller.kind": law.name})
        works[words] = lambda scenario=scenario: simulate(scenario)
    carrying = law.code()

    def step_from_outside() -> None:
        for tick in Simulation(base).ticks():
            carrying.command(tick.seen, None, tick)

    works["from outside, tick by tick, the same Python"] = step_from_outside
    return works
