"""SIGKILL of the worker processes of a study, repeated until it is finished."""

from __future__ import annotations

import os
import random
import signal
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchmarks.processes import background_threads, family_of
from benchmarks.study import random_study, write_study
from slipgrasp.core.executors import make_executor
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.loading import study_from_mapping

WORKERS = 2
POLL = 0.01
PAUSES = (0.0, 0.3)


def kill_workers(
    count: int, seed: int, runs: int, engine: str = "processes", every: float | None = None
) -> dict[str, Any]:
    """Kills workers while they simulate a study, and compares it with an undisturbed one.

    Args:
        count: Largest number of kills; fewer if the study finishes earlier.
        seed: Seed of the times and workers.
        runs: Number of runs of the study.
        engine: Executor of the workers: ``processes`` or ``dask``.
        every: Interval of the kills [s]; None for random pauses after each progress.

    Returns:
        Number of ``killed`` workers; number of ``runs``, each simulated exactly once; ``seconds``
        from the first kill to the last.

    Raises:
        AssertionError: If the two studies are not the same file, or a study with kills at an
            interval finishes earlier.
    """
    ranges = {"object.mass": (0.7, 1.6), "simulation.duration": (0.1, 1.0)}
    study = study_from_mapping(random_study(runs, ranges), load_scenario)
    with tempfile.TemporaryDirectory() as name:
        files = Path(name) / "undisturbed.mcap", Path(name) / "killed.mcap"
        with make_executor("processes", workers=WORKERS) as executor:
            write_study(study, executor, files[0])
        killer = _Killer(count, random.Random(seed), every)
        with make_executor(engine, workers=WORKERS) as executor:
            if every is not None:
                executor.prepare()
            with background_threads(killer.kill_repeatedly):
                write_study(study, executor, files[1], lambda _row: killer.went_on.set())
        assert files[0].read_bytes() == files[1].read_bytes(), "a kill has changed the study"
    kills = killer.times
    assert every is None or len(kills) == count, "the study was done before"
    return {"killed": len(kills), "runs": runs, "seconds": kills[-1] - kills[0] if kills else 0.0}


class _Killer:
    """Kills children of this process, at intervals or whenever the study has progressed.

    Attributes:
        times: Times of the kills [s].
        went_on: Set when the study has progressed.
    """

    def __init__(self, count: int, source: random.Random, every: float | None) -> None:
        self.times: list[float] = []
        self.went_on = threading.Event()
        self._count, self._source, self._every = count, source, every
        self._others = set(family_of(os.getpid()))

    def kill_repeatedly(self, ended: threading.Event) -> None:
        """Kills workers until the study ends."""
        while len(self.times) < self._count and not ended.wait(self._every or POLL):
            if self._every is None:
                if not self.went_on.is_set():
                    continue
                time.sleep(self._source.uniform(*PAUSES))
            workers = sorted(filter(_is_worker, set(family_of(os.getpid())) - self._others))
            if workers and not ended.is_set():
                with suppress(ProcessLookupError):
                    os.kill(self._source.choice(workers), signal.SIGKILL)
                    self.times.append(time.monotonic())
            self.went_on.clear()


def _is_worker(process: int) -> bool:
    """Whether a process executes tasks: Dask also has helper processes."""
    with suppress(OSError):
        command = Path(f"/proc/{process}/cmdline").read_bytes()
        return any(name in command for name in (b"slipgrasp.core.executors", b"spawn_main"))
    return False
