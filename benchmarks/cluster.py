"""Cost of a study with every executor, and the resulting limits of a cluster of workers."""

from __future__ import annotations

import math
import pickle
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.report import Table, table_of_rows
from benchmarks.study import make_study, write_study
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.executors import Executor, Finished, make_executor
from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.study.definition import MAX_RUNS, Study
from slipgrasp.recordings.study.writer import RUNS_PER_CHUNK

PAGE = "scaling.md"
ONE_WORKER, DASK = "1 worker process", "Dask, 2 workers"
CLUSTERS = (2, 16, 128, 1024)
LARGE = 10**9

_UNITS = (("s", 1.0), ("min", 60.0), ("h", 3600.0), ("days", 86_400.0), ("years", 31_557_600.0))


class Costs(NamedTuple):
    """The measurements.

    Attributes:
        worker: CPU time of a run in its worker [s].
        scheduler: CPU time of a run in the scheduler [s].
        rates: Runs per second of the executors [1/s].
        tasks: Empty tasks per second of the executors [1/s].
        row: Size of a run in the file of the study [B].
    """

    worker: float
    scheduler: float
    rates: dict[str, float]
    tasks: dict[str, float]
    row: float


def run() -> list[Table]:
    """The tables ``study-cost``, ``study-engines`` and ``study-clusters`` of scaling.md."""
    costs = measure_costs()
    parts = {
        "of a worker: scenario, simulation, hash, metrics": costs.worker,
        "of the scheduler: hand out, take back, check, compress, write": costs.scheduler,
    }
    rows = tuple((words, f"{MILLISECONDS * seconds:.2f}") for words, seconds in parts.items())
    note = f"In the file of the study a run takes {costs.row:.0f} B."
    heads = ("CPU time of a run of 7 s", "[ms]")
    cost = Table("study-cost", heads, rows, (note,), page=PAGE)
    return [cost, _tabulate_engines(costs), project(costs)]


def measure_costs(count: int = 600, rounds: int = 3, empty: int = 1000) -> Costs:
    """Costs of a study, and rates of all executors, measured in turns.

    Args:
        count: Number of runs of the study.
        rounds: Number of timings of each.
        empty: Number of empty tasks that are timed.
    """
    study = make_study(count)
    engines = {
        "in one process": InlineExecutor(),
        ONE_WORKER: make_executor("processes", workers=1),
        "2 worker processes": make_executor("processes", workers=2),
        DASK: make_executor("dask", workers=2),
    }
    with ExitStack() as opened:
        for engine in engines.values():
            opened.enter_context(engine)
            engine.prepare()
        works = {name: partial(_size_of_study, study, each) for name, each in engines.items()}
        seconds = median_seconds(works, rounds, time.perf_counter)
        worker, scheduler, row = measure_costs_of_a_run(study, rounds)
        idle = {name: partial(_pass_tasks, each, empty) for name, each in engines.items()}
        passed = median_seconds(idle, rounds, time.perf_counter)
    rates = {name: count / own for name, own in seconds.items()}
    tasks = {name: empty / own for name, own in passed.items()}
    return Costs(worker, scheduler, rates, tasks, row)


def measure_costs_of_a_run(study: Study, rounds: int) -> tuple[float, float, float]:
    """CPU time of a run in its worker and in the scheduler [s], and its size in the file [B].

    Args:
        study: The study.
        rounds: Number of timings of each.
    """
    collector, replay = _Collector(), _Collector()
    size = _size_of_study(study, collector)
    replay.packed, replay.replays = collector.packed, True
    works = {
        "all": partial(_size_of_study, study, collector),
        "scheduler": partial(_size_of_study, study, replay),
    }
    seconds = median_seconds(works, rounds)
    worker = seconds["all"] - seconds["scheduler"]
    return worker / study.num_runs, seconds["scheduler"] / study.num_runs, size / study.num_runs


def project(costs: Costs) -> Table:
    """The calculated duration of studies on clusters."""
    of_worker = costs.rates[ONE_WORKER]
    of_scheduler = min(1.0 / costs.scheduler, RUNS_PER_CHUNK * costs.tasks[DASK])
    rows = {str(number): _project_row(number * of_worker, of_scheduler) for number in CLUSTERS}
    small, large = MAX_RUNS * costs.row / 1e6, LARGE * costs.row / 1e9
    note = (
        f"One worker: {of_worker:.0f} runs/s. One scheduler: {of_scheduler:.0f} runs/s at most. "
        f"A study has at most {MAX_RUNS} runs ({small:.0f} MB); {LARGE} runs are "
        f"{LARGE // MAX_RUNS} studies ({large:.0f} GB)."
    )
    return table_of_rows("study-clusters", "workers", rows, note, page=PAGE)


def _project_row(possible: float, of_scheduler: float) -> dict[str, str]:
    """Durations at a possible rate of the workers, and at that of one scheduler [1/s]."""
    rate, large = min(possible, of_scheduler), f"{LARGE:.0e} runs"
    return {
        f"{MAX_RUNS:.0e} runs": _duration(MAX_RUNS / rate),
        f"{large}, one scheduler": _duration(LARGE / rate),
        "schedulers that keep them busy": str(math.ceil(possible / of_scheduler)),
        f"{large} with these": _duration(LARGE / possible),
    }


def _duration(seconds: float) -> str:
    """A duration with two digits, in the largest unit that gives at least 1.5."""
    units = [(name, unit) for name, unit in _UNITS if seconds >= 1.5 * unit]
    name, unit = units[-1] if units else _UNITS[0]
    count = seconds / unit
    return f"{count:.1f} {name}" if count < 10.0 else f"{count:.0f} {name}"


def _tabulate_engines(costs: Costs) -> Table:
    one = costs.rates[ONE_WORKER]
    rows = {
        name: {
            "runs/s": f"{rate:.0f}",
            "of 1 worker": f"{rate / one:.2f}",
            "empty tasks/s": f"{costs.tasks[name]:.0f}",
        }
        for name, rate in costs.rates.items()
    }
    return table_of_rows("study-engines", "engine", rows, page=PAGE)


class _Collector(InlineExecutor):
    """Retains the results as a worker sends them, and then yields them without computing."""

    def __init__(self) -> None:
        self.packed: dict[int, bytes] = {}
        self.replays = False

    def map(
        self,
        function: Callable[[Any, Callable[[], bool]], Any],
        tasks: Iterable[Any],
        *,
        should_stop: Callable[[], bool],
    ) -> Iterator[Finished[Any, Any]]:
        """Executes the tasks, or yields their stored results."""
        if not self.replays:
            for done in super().map(function, tasks, should_stop=should_stop):
                self.packed[done.task.first] = pickle.dumps(done.result, pickle.HIGHEST_PROTOCOL)
                yield done
            return
        for task in tasks:
            pickle.dumps((function, task), pickle.HIGHEST_PROTOCOL)
            yield Finished(task, pickle.loads(self.packed[task.first]))


def _size_of_study(study: Study, executor: Executor) -> int:
    """Executes a study, and returns the size of its file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.mcap"
        write_study(study, executor, file)
        return file.stat().st_size


def _pass_tasks(executor: Executor, count: int) -> None:
    """Executes empty tasks."""
    done = executor.map(_do_nothing, range(count), should_stop=lambda: False)
    assert sum(1 for _ in done) == count


def _do_nothing(task: int, should_stop: Callable[[], bool]) -> int:
    return task
