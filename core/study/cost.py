"""What a study will take, found out from some of its runs."""

from __future__ import annotations

import random
import time
from dataclasses import dataclass

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.study.definition import Study

_PATIENCE = 1.0
_TIMED = 8
_BYTES_PER_ROW = 600
_OVERHEAD_PER_RUN = 0.0015


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyCost:
    """How much a study is going to take.

    Attributes:
        runs: Runs.
        seconds: Computing time with all workers [s].
        bytes: What is kept of it on disk, if every recording that may be kept is.
    """

    runs: int
    seconds: float
    bytes: int


def estimate_cost(study: Study, num_workers: int) -> StudyCost:
    """Simulates some of its runs, for a second at most in all, and multiplies.

    Laws differ in what they cost, one in Python from the others by an order of magnitude.

    Args:
        study: The study; nothing of it is expanded.
        num_workers: How many runs are simulated at a time.
    """
    prepare_kernel()
    timed = random.Random(0).sample(range(study.num_runs), min(study.num_runs, _TIMED))
    times = [_time_of(study, index) for index in timed]
    per_run = sum(times) / len(times)
    columns = Simulation(study.base).shape.num_columns
    rows = study.base.simulation.duration * study.base.simulation.output_rate
    recorded = 0 if study.recordings == "none" else rows * columns * 8
    return StudyCost(
        runs=study.num_runs,
        seconds=study.num_runs * (per_run + _OVERHEAD_PER_RUN) / num_workers,
        bytes=round(study.num_runs * (_BYTES_PER_ROW + recorded)),
    )


def _time_of(study: Study, index: int) -> float:
    """The duration of a run [s]; none if it is refused, which is reported elsewhere."""
    try:
        simulation = Simulation(study.scenario_of(index))
    except ScenarioError:
        return 0.0
    started = time.perf_counter()
    while not simulation.finished and time.perf_counter() - started < _PATIENCE / _TIMED:
        simulation.advance()
    share = 1.0 if simulation.finished else max(simulation.progress, 1e-6)
    return (time.perf_counter() - started) / share
