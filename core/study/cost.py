"""What a study will take, found out from one run of its base."""

from __future__ import annotations

import time
from dataclasses import dataclass

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.study.definition import Study

_PATIENCE = 1.0
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
    """Simulates the base once, for a second at most, and multiplies.

    Args:
        study: The study; nothing of it is expanded.
        num_workers: How many runs are simulated at a time.
    """
    prepare_kernel()
    simulation = Simulation(study.base)
    started = time.perf_counter()
    while not simulation.finished and time.perf_counter() - started < _PATIENCE:
        simulation.advance()
    share = 1.0 if simulation.finished else max(simulation.progress, 1e-6)
    per_run = (time.perf_counter() - started) / share
    rows = study.base.simulation.duration * study.base.simulation.output_rate
    recorded = 0 if study.recordings == "none" else rows * simulation.shape.num_columns * 8
    return StudyCost(
        runs=study.num_runs,
        seconds=study.num_runs * (per_run + _OVERHEAD_PER_RUN) / num_workers,
        bytes=round(study.num_runs * (_BYTES_PER_ROW + recorded)),
    )
