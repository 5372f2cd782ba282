"""SIGKILL of the worker processes of a study, repeated until it is finished."""

from __future__ import annotations

import os
import random
import signal
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.processes import family_of
from slipgrasp.core.executors import Executor, make_executor
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.writer import StudyWriter

WORKERS = 2
POLL = 0.01
PAUSES = (0.0, 0.3)


@dataclass(frozen=True, slots=True)
class WorkerKills:
    """A study whose workers were killed.

    Attributes:
        count: Number of killed workers.
        runs: Number of runs of the study, each simulated exactly once.
    """

    count: int
    runs: int


def kill_workers(
    count: int, seed: int, runs: int = 20_000, engine: str = "processes"
) -> WorkerKills:
    """Kills workers while they simulate a study, and compares it with an undisturbed one.

    Args:
        count: Largest number of kills; fewer if the study finishes earlier.
        seed: Seed of the times and workers.
        runs: Number of runs of the study.
        engine: Executor of the workers: ``processes`` or ``dask``.

    Raises:
        AssertionError: If the two studies are not the same file.
    """
    study = _short_runs(runs)
    with tempfile.TemporaryDirectory() as name:
        files = Path(name) / "undisturbed.mcap", Path(name) / "killed.mcap"
        with make_executor("processes", workers=WORKERS) as executor:
            _schedule(study, executor, files[0], lambda: None)
        killer = _Killer(count, seed)
        with make_executor(engine, workers=WORKERS) as executor, killer:
            _schedule(study, executor, files[1], killer.note_row)
        assert files[0].read_bytes() == files[1].read_bytes(), "a kill has changed the study"
    return WorkerKills(killer.killed, runs)


def kill_in_a_burst(count: int, seconds: float, runs: int = 2000) -> float:
    """Kills workers of a study at regular intervals, and compares it with an undisturbed one.

    Args:
        count: Number of kills.
        seconds: Total time of the kills [s].
        runs: Number of runs of the study.

    Returns:
        Time from the first kill to the last [s].

    Raises:
        AssertionError: If the two studies are not the same file, or the study finished earlier.
    """
    study, kills = _short_runs(runs), list[float]()
    others = set(family_of(os.getpid()))

    def kill_all() -> None:
        while len(kills) < count:
            time.sleep(seconds / (count + 1))
            for worker in sorted(set(family_of(os.getpid())) - others)[:1]:
                with suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    kills.append(time.monotonic())

    with tempfile.TemporaryDirectory() as name:
        files = Path(name) / "undisturbed.mcap", Path(name) / "killed.mcap"
        with make_executor("processes", workers=WORKERS) as executor:
            _schedule(study, executor, files[0], lambda: None)
        killer = threading.Thread(target=kill_all, daemon=True)
        with make_executor("processes", workers=WORKERS) as executor:
            executor.prepare()
            killer.start()
            _schedule(study, executor, files[1], lambda: None)
        assert len(kills) == count, "the study was done before"
        assert files[0].read_bytes() == files[1].read_bytes(), "a kill has changed the study"
    return kills[-1] - kills[0]


def _short_runs(runs: int) -> Study:
    mapping = {
        "base": "paper-case-1",
        "sampling": {"method": "random", "runs": runs, "seed": 1},
        "recordings": "none",
        "vary": {
            "object.mass": {"min": 0.7, "max": 1.6},
            "simulation.duration": {"min": 0.1, "max": 1.0},
        },
    }
    return study_from_mapping(mapping, load_scenario)


def _schedule(study: Study, executor: Executor, file: Path, note_row: Callable[[], None]) -> None:
    with StudyWriter(file, study) as writer:
        end = schedule_runs(
            study,
            executor,
            writer,
            should_stop=lambda: False,
            watch=lambda row: note_row(),
            keep=lambda member: None,
        )
        writer.finish(end)
    assert (end.state, end.runs) == ("completed", study.num_runs)


class _Killer:
    """Kills a child of this process whenever the study has progressed since the last time.

    Attributes:
        killed: Number of killed processes.
    """

    def __init__(self, count: int, seed: int) -> None:
        self.killed = 0
        self._count = count
        self._source = random.Random(seed)
        self._others = set(family_of(os.getpid()))
        self._went_on = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._kill, daemon=True)

    def note_row(self) -> None:
        """Records that the study has progressed."""
        self._went_on.set()

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _kill(self) -> None:
        while self.killed < self._count and not self._ended.wait(POLL):
            if not self._went_on.is_set():
                continue
            time.sleep(self._source.uniform(*PAUSES))
            workers = sorted(filter(_is_worker, set(family_of(os.getpid())) - self._others))
            if workers and not self._ended.is_set():
                with suppress(ProcessLookupError):
                    os.kill(self._source.choice(workers), signal.SIGKILL)
                    self.killed += 1
            self._went_on.clear()


def _is_worker(process: int) -> bool:
    """Whether a process executes tasks: Dask also has helper processes."""
    with suppress(OSError):
        command = Path(f"/proc/{process}/cmdline").read_bytes()
        return any(name in command for name in (b"slipgrasp.core.executors", b"spawn_main"))
    return False
