"""Studies of thousands of runs: rate compared with the kernel alone, response times, memory.

`python -m benchmarks.study RUNS` measures the kernel alone: it simulates the runs of such a study
on two threads, at the priority of worker processes, and prints the time from the first result to
the last [s].
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.faults.services import start_service
from benchmarks.processes import MemoryWatch
from benchmarks.report import Table
from benchmarks.study_load import API, Client, Load, run_over_rest
from benchmarks.timing import MILLISECONDS
from slipgrasp.core.executors import Executor, make_executor
from slipgrasp.core.executors.worker import NICENESS
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.writer import RUNS_PER_CHUNK, StudyWriter

ROUNDS = 3
COUNT = 2000
LARGE = 10_000
WORKERS = 2
WARM_UP = 100
PAGES = 20
RATE_TARGET = 0.6
ANSWER_TARGET = 0.25  # [s], 95th percentile
MEMORY_TARGET = 1.5e9  # [B]
SLOPE_TARGET = 1000.0  # [B] per run

_ROOT = Path(__file__).parents[1]


class _Rates(NamedTuple):
    """Runs per second of every method, by round, and other measurements."""

    by_way: dict[str, list[float]]
    loads: list[Load]
    peak: int
    start_seconds: float


def run(_docs: Path | None = None) -> list[Table]:
    """The tables ``study``, ``study-answers`` and ``study-large``."""
    return [*measure_rates(), measure_large_study()]


def describe_study(count: int) -> dict[str, Any]:
    """A study of case I as a request: random mass and frictions, two laws on each sample."""
    return {
        "base": "paper-case-1",
        "sampling": {"method": "random", "runs": count // 2, "seed": 1},
        "recordings": "none",
        "vary": {
            "object.mass": {"min": 0.7, "max": 1.6},
            "fingers.0.friction": {"min": 0.2, "max": 0.5},
            "fingers.1.friction": {"min": 0.2, "max": 0.5},
            "controller.lyapunov_weight": {"values": [1.0, 20.0]},
        },
    }


def measure_rates(count: int = COUNT, rounds: int = ROUNDS) -> tuple[Table, Table]:
    """Runs per second of the kernel alone, of worker processes and over REST, in turns.

    Args:
        count: Number of runs of the study.
        rounds: Number of rounds.
    """
    with tempfile.TemporaryDirectory() as name:
        found = _take_turns(count, rounds, Path(name))
    return _tabulate_rates(count, found), _tabulate_answers(count, found)


def _take_turns(count: int, rounds: int, folder: Path) -> _Rates:
    service, url = start_service(folder / "data")
    by_way: dict[str, list[float]] = defaultdict(list)
    loads: list[Load] = []
    executor = make_executor("processes", workers=WORKERS)
    with service, executor, Client(url) as client, MemoryWatch(service.pid) as watch:
        try:
            run_over_rest(client, describe_study(WARM_UP), watch)
            start_seconds = executor.prepare()
            for number in range(rounds):
                by_way["bare kernel"].append((count - 1) / _time_bare_kernel(count))
                file = folder / f"{number}.mcap"
                by_way["worker processes"].append(_schedule(count, executor, file))
                loads.append(run_over_rest(client, describe_study(count), watch))
                by_way["over REST"].append(loads[-1].rate)
                stored = client.ask(f"{API}/{loads[-1].study}/recording")
                assert stored == file.read_bytes(), "REST gave another study"
        finally:
            service.terminate()
    return _Rates(by_way, loads, watch.peak, start_seconds)


def _time_bare_kernel(count: int) -> float:
    """Time from the first result to the last, in a separate process [s]."""
    command = [sys.executable, "-m", "benchmarks.study", str(count)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=_ROOT)
    return float(done.stdout)


def make_study(count: int) -> Study:
    """The same as a study."""
    return study_from_mapping(describe_study(count), load_scenario)


def _schedule(count: int, executor: Executor, file: Path) -> float:
    """Rate of a study on workers, from its first row to its last [1/s]."""
    study = make_study(count)
    moments: list[float] = []
    with StudyWriter(file, study) as writer:
        end = schedule_runs(
            study,
            executor,
            writer,
            should_stop=lambda: False,
            watch=lambda row: moments.append(time.perf_counter()),
            keep=lambda member: None,
        )
        writer.finish(end)
    assert len(moments) == count
    # The rows of a task arrive together: those of the first one were computed before.
    return (count - RUNS_PER_CHUNK) / (moments[-1] - moments[0])


def _tabulate_rates(count: int, found: _Rates) -> Table:
    rates = {way: statistics.median(values) for way, values in found.by_way.items()}
    bare = rates["bare kernel"]
    words = {
        "bare kernel": f"bare kernel, {WORKERS} threads, no trace, no hash",
        "worker processes": f"{WORKERS} warm worker processes, rows and hashes kept",
        "over REST": f"the same over REST, with a client that asks {_questions(found):.0f} times/s",
    }
    rows = tuple((words[way], f"{rate:.0f}", f"{rate / bare:.2f}") for way, rate in rates.items())
    met = "met" if rates["over REST"] >= RATE_TARGET * bare else "missed"
    notes = (
        f"Median of {len(found.loads)} rounds; target {RATE_TARGET:g} over REST: {met}. "
        "All files are equal, byte for byte.",
        f"Starting the workers: {found.start_seconds:.1f} s.",
    )
    return Table("study", (f"{count} runs of 7 s, varied", "runs/s", "ratio"), rows, notes)


def _questions(found: _Rates) -> float:
    load = Load.together(found.loads)
    return sum(map(len, load.answers.values())) / load.seconds


def _tabulate_answers(count: int, found: _Rates) -> Table:
    load = Load.together(found.loads)
    slowest = load.percentile(95)
    met = "met" if slowest < ANSWER_TARGET else "missed"
    used = "met" if found.peak < MEMORY_TARGET else "missed"
    notes = (
        f"All together: 95th percentile {MILLISECONDS * slowest:.0f} ms; target "
        f"{MILLISECONDS * ANSWER_TARGET:.0f} ms: {met}.",
        f"Service and workers together took {found.peak / 1e6:.0f} MB at most; target "
        f"{MEMORY_TARGET / 1e6:.0f} MB: {used}.",
    )
    heads = (f"answers while {count} runs go on", "answers", "median [ms]", "95th percentile [ms]")
    rows = tuple(_answer_row(load, kind) for kind in load.answers)
    return Table("study-answers", heads, rows, notes)


def _answer_row(load: Load, kind: str) -> tuple[str, ...]:
    times = (f"{MILLISECONDS * load.percentile(share, kind):.0f}" for share in (50, 95))
    return kind, str(len(load.answers[kind])), *times


def measure_large_study(count: int = LARGE) -> Table:
    """Memory while a study grows, and pages of its results after its end.

    Args:
        count: Number of runs of the study.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        service, url = start_service(folder)
        with service, Client(url) as client, MemoryWatch(service.pid) as watch:
            try:
                warm_up = run_over_rest(client, describe_study(WARM_UP), watch)
                client.ask(f"{API}/{warm_up.study}/map.svg")  # loads the drawing library
                load = run_over_rest(client, describe_study(count), watch)
                pages = _time_pages(client, load.study, count)
                size = (folder / "studies" / f"{load.study}.mcap").stat().st_size
                assert not list(folder.glob("*.mcap")), "a run was kept unasked"
            finally:
                service.terminate()
    slope = _slope(watch, count)
    rows = (
        ("runs per second", f"{load.rate:.0f}"),
        (
            "95th percentile of the answers meanwhile [ms]",
            f"{MILLISECONDS * load.percentile(95):.0f}",
        ),
        ("peak memory of service and workers [MB]", f"{watch.peak / 1e6:.0f}"),
        ("memory per further run, second half [kB]", f"{slope / 1e3:.2f}"),
        ("file of the study, per run [B]", f"{size / count:.0f}"),
        *((f"{kind} [ms]", f"{MILLISECONDS * seconds:.0f}") for kind, seconds in pages.items()),
    )
    met = "met" if slope < SLOPE_TARGET else "missed"
    note = f"Target below {SLOPE_TARGET / 1e3:.0f} kB of memory per run: {met}."
    return Table("study-large", (f"a study of {count} runs over REST", ""), rows, (note,))


def _time_pages(client: Client, study: str, count: int) -> dict[str, float]:
    """Median response time of requests about a finished study [s]."""
    results = f"{API}/{study}/results?limit=100"
    paths = {
        "list of studies": API,
        "first page of results": results,
        "last page of results": f"{results}&offset={count - 100}",
        "page sorted by a metric": f"{results}&sort=-slip_path_0&offset={count // 2}",
        "page of one outcome": f"{results}&outcome=completed",
        "summary": f"{API}/{study}/summary",
    }
    return {kind: _median_seconds(client, path) for kind, path in paths.items()}


def _median_seconds(client: Client, path: str) -> float:
    seconds = []
    for _ in range(PAGES):
        start = time.perf_counter()
        client.ask(path)
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def _slope(watch: MemoryWatch, count: int) -> float:
    """Memory per additional run over the second half, after everything is loaded [B]."""
    half = [sample for sample in watch.samples if count / 2 < sample.progress < count]
    done, memory = zip(*half, strict=True)
    return float(np.polyfit(done, memory, 1)[0])


def main() -> None:
    """Simulates the runs of a study, and prints the time from the first to the last."""
    os.nice(NICENESS)
    study = make_study(int(sys.argv[1]))
    scenarios = [study.scenario_of(index) for index in range(study.num_runs)]
    runs = simulate_many(scenarios, threads=WORKERS)
    next(runs)
    start = time.perf_counter()
    for _ in runs:
        pass
    sys.stdout.write(f"{time.perf_counter() - start}\n")


if __name__ == "__main__":
    main()
