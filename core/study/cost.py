"""Estimate of the cost of a study, from some of its runs."""

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
    """Estimated cost of a study.

    Attributes:
        runs: Number of runs.
        seconds: Elapsed time with all workers [s].
        bytes: Size on disk [bytes], if every allowed recording is stored.
    """

    runs: int
    seconds: float
    bytes: int


def estimate_cost(study: Study, num_workers: int) -> StudyCost:
    """Simulates some of the runs, for at most a second in total, and extrapolates.

    Laws differ in cost, by an order of magnitude between Python and compiled ones.

    Args:
        study: The study; it is not expanded.
        num_workers: Number of concurrent runs.
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
    """Elapsed time of a whole run, extrapolated [s]; 0 if it is invalid, reported elsewhere."""
    try:
        simulation = Simulation(study.scenario_of(index))
    except ScenarioError:
        return 0.0
    started = time.perf_counter()
    while not simulation.finished and time.perf_counter() - started < _PATIENCE / _TIMED:
        simulation.advance()
    share = 1.0 if simulation.finished else max(simulation.progress, 1e-6)
    return (time.perf_counter() - started) / share
