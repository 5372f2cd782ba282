"""Many varied runs on two threads, compared with MuJoCo on two threads."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator

import numpy as np

from benchmarks.mujoco_hold import Hold, hold_by_actuators
from benchmarks.report import Table, judge
from benchmarks.timing import median_seconds, on_threads
from slipgrasp import simulate_many
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.definition import apply_values

THREADS = 2
TARGET, AIM = 10.0, 30.0
VARIED = ("object.mass", "fingers.*.friction")


def vary(name: str, count: int, duration: float) -> Iterator[Scenario]:
    """Variants of a preset: object 0.8 to 1.3 kg, friction 0.2 to 0.4; the same every time.

    Args:
        name: The preset.
        count: Number of variants.
        duration: Simulated time of each [s].
    """
    base = with_values(load_scenario(name), {"simulation.duration": duration})
    for drawn in np.random.default_rng(1).uniform((0.8, 0.2), (1.3, 0.4), (count, 2)).tolist():
        yield apply_values(
            base, dict(zip(("object.mass", "fingers.*.friction"), drawn, strict=True))
        )


def run(count: int = 200, rounds: int = 3, duration: float = 7.0) -> list[Table]:
    """The table ``batch``: runs per second of wall time, measured in turns.

    Args:
        count: Runs of a batch.
        rounds: Number of timings of each batch.
        duration: Simulated time of every run [s].
    """
    scenarios = list(vary("paper-case-1", count, duration))
    holds = [hold_by_actuators(scenario, duration) for scenario in scenarios]
    ours = f"slipgrasp, {THREADS} threads"
    theirs = f"MuJoCo, 1 ms, no controller, {THREADS} threads"
    works = {
        theirs: lambda: on_threads(Hold.run, holds, THREADS),
        ours: lambda: list(simulate_many(scenarios, threads=THREADS)),
    }
    seconds = median_seconds(works, rounds, time.perf_counter)
    rows = tuple(
        (name, f"{count / own:.0f}", f"{seconds[theirs] / own:.1f}")
        for name, own in seconds.items()
    )
    # Those that end early are cheaper.
    ends = Counter(summary.outcome for summary in simulate_many(scenarios, threads=THREADS))
    counts = ", ".join(f"{number} {outcome.value}" for outcome, number in ends.items())
    ratio = judge(seconds[theirs] / seconds[ours], TARGET, AIM)
    notes = (f"{ratio}.", f"Outcomes of our runs: {counts}.")
    heads = (f"{count} varied runs of {duration:g} s", "runs/s", "ratio")
    return [Table("batch", heads, rows, notes)]
