"""Studies of thousands of runs: rate compared with the kernel alone, response times, memory.

`python -m benchmarks.study RUNS` measures the kernel alone: it simulates the runs of such a study
on two threads, at the priority of worker processes, and prints the time from the first result to
the last [s].
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.processes import family_of, memory_of, run_module, watch
from benchmarks.report import Table, met, table_of_rows
from benchmarks.service import PATIENCE, Service, serve
from benchmarks.timing import MILLISECONDS
from slipgrasp.core.executors import Executor, make_executor
from slipgrasp.core.executors.worker import NICENESS
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.writer import RUNS_PER_CHUNK, StudyWriter

WORKERS = 2
WARM_UP = 100
MEMORY_PERIOD = 0.25  # [s]
PAGES = 20
RATE_TARGET = 0.6
ANSWER_TARGET = 0.25  # [s], 95th percentile
MEMORY_TARGET = 1.5e9  # [B]
SLOPE_TARGET = 1000.0  # [B] per run
STUDIES = "/studies"
PAUSE = 0.1
PAGE = 100
MAP_EVERY = 10.0  # [s]


@dataclass(slots=True)
class Load:
    """Measurements of a client during studies.

    Attributes:
        seconds: Time from first results to last ones [s].
        answers: Response times of each kind [s].
        finished: Number of finished runs of the present study.
    """

    seconds: float = 0.0
    answers: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    finished: int = 0

    @property
    def asked(self) -> int:
        """Number of responses."""
        return sum(map(len, self.answers.values()))

    def percentile(self, share: float) -> float:
        """Percentile of all response times [s]."""
        return float(np.percentile([t for times in self.answers.values() for t in times], share))


def run_over_rest(service: Service, study: Mapping[str, Any], load: Load) -> tuple[str, float]:
    """Runs a study, and requests its status and other data until it is complete.

    Args:
        service: The service.
        study: The study, as in a request.
        load: Receives the measurements.

    Returns:
        The id of the study, and its rate from its first results to its last [1/s].

    Raises:
        AssertionError: If it fails, or does not end within 15 minutes.
    """
    asked = time.perf_counter()
    created = service.ask(STUDIES, study)
    path = f"{STUDIES}/{created['id']}"
    kinds = _kinds(path)
    first = first_done = 0.0
    while True:
        before = time.perf_counter()
        status = service.ask(path)
        now = time.perf_counter()
        load.answers["status"].append(now - before)
        assert status["state"] in ("queued", "running", "completed"), status
        assert now - asked < PATIENCE, status
        done = load.finished = status["finished"]
        if done and not first_done:
            first, first_done = now, done
        if done == created["num_runs"] and status["state"] == "completed":
            break
        if done:
            kind, page = next(kinds)
            load.answers[kind].append(service.seconds_of(page))
        time.sleep(PAUSE)
    load.seconds += now - first
    return created["id"], (done - first_done) / (now - first) if now > first else 0.0


def _kinds(study: str) -> Iterator[tuple[str, str]]:
    """The requests in turns, with an occasional map."""
    page = f"{study}/results?limit={PAGE}"
    drawn = time.monotonic()
    while True:
        yield "list of studies", f"{STUDIES}?limit={PAGE}"
        yield "page of results", page
        yield "page sorted by a metric", f"{page}&sort=-slip_path_0"
        if time.monotonic() - drawn > MAP_EVERY:
            yield "map", f"{study}/map.svg"
            drawn = time.monotonic()


def run() -> list[Table]:
    """The tables ``study``, ``study-answers`` and ``study-large``."""
    return [*measure_rates(), measure_large_study()]


def random_study(
    runs: int, ranges: Mapping[str, tuple[float, float]], seed: int = 1, **more: Any
) -> dict[str, Any]:
    """A study of case I with random values as a request.

    Args:
        runs: Number of samples.
        ranges: Smallest and largest value of each varied parameter.
        seed: Seed of the samples.
        **more: Further tables and keys of the study.
    """
    return {
        "base": "paper-case-1",
        "sampling": {"method": "random", "runs": runs, "seed": seed},
        "recordings": "none",
        "vary": {key: {"min": low, "max": high} for key, (low, high) in ranges.items()},
        **more,
    }


def describe_study(count: int) -> dict[str, Any]:
    """A study as a request: random mass and frictions, two laws on each sample."""
    ranges = {"object.mass": (0.7, 1.6)}
    ranges |= dict.fromkeys(("fingers.0.friction", "fingers.1.friction"), (0.2, 0.5))
    study = random_study(count // 2, ranges)
    study["vary"]["controller.lyapunov_weight"] = {"values": [1.0, 20.0]}
    return study


def measure_rates(count: int = 2000, rounds: int = 3) -> tuple[Table, Table]:
    """Runs per second of the kernel alone, of worker processes and over REST, in turns.

    Args:
        count: Number of runs of the study.
        rounds: Number of rounds.
    """
    rates: dict[str, list[float]] = defaultdict(list)
    load = Load()
    with (
        tempfile.TemporaryDirectory() as name,
        make_executor("processes", workers=WORKERS) as executor,
        _watched(Path(name) / "data", load) as (service, samples),
    ):
        start_seconds = executor.prepare()
        for number in range(rounds):
            bare = f"bare kernel, {WORKERS} threads, no trace, no hash"
            # From the first result to the last, in a separate process.
            rates[bare].append((count - 1) / float(run_module("benchmarks.study", str(count))))
            file = Path(name) / f"{number}.mcap"
            warm = f"{WORKERS} warm worker processes, rows and hashes kept"
            rates[warm].append(_rate(count, executor, file))
            study, rate = run_over_rest(service, describe_study(count), load)
            rates["the same over REST, with a client that asks {} times/s"].append(rate)
            stored = service.exchange(f"{STUDIES}/{study}/recording").content
            assert stored == file.read_bytes(), "REST gave another study"
    answers = _tabulate_answers(count, load, max(memory for _, memory in samples))
    return _tabulate_rates(count, rates, load, start_seconds), answers


@contextmanager
def _watched(folder: Path, load: Load) -> Iterator[tuple[Service, list[tuple[int, int]]]]:
    """A service that has done a study and drawn its map, and samples of the load and its memory."""
    with serve(folder) as service:

        def look() -> tuple[int, int]:
            finished = load.finished
            return finished, sum(map(memory_of, family_of(service.process.pid)))

        with watch(look, MEMORY_PERIOD) as samples:
            study, _ = run_over_rest(service, describe_study(WARM_UP), Load())
            service.seconds_of(f"{STUDIES}/{study}/map.svg")
            yield service, samples


def make_study(count: int) -> Study:
    """The same as a study."""
    return study_from_mapping(describe_study(count), load_scenario)


def write_study(
    study: Study,
    executor: Executor,
    file: Path,
    on_row: Callable[[StudyRow], None] = lambda row: None,
) -> None:
    """Executes a study, and writes its file.

    Args:
        study: The study.
        executor: Executes the runs.
        file: Path of the file.
        on_row: Called with each row.

    Raises:
        AssertionError: If not all runs are done.
    """
    with StudyWriter(file, study) as writer:
        never, drop = lambda: False, lambda member: None
        end = schedule_runs(study, executor, writer, should_stop=never, watch=on_row, keep=drop)
        writer.finish(end)
    assert (end.state, end.runs) == ("completed", study.num_runs)


def _rate(count: int, executor: Executor, file: Path) -> float:
    """Rate of a study on workers, from its first row to its last [1/s]."""
    moments: list[float] = []
    write_study(make_study(count), executor, file, lambda _row: moments.append(time.perf_counter()))
    # The rows of a task arrive together: those of the first one were computed before.
    return (count - RUNS_PER_CHUNK) / (moments[-1] - moments[0])


def _tabulate_rates(
    count: int, found: Mapping[str, list[float]], load: Load, start_seconds: float
) -> Table:
    rates = {way: statistics.median(values) for way, values in found.items()}
    bare, *_, rest = rates.values()
    asked = f"{load.asked / load.seconds:.0f}"
    rows = tuple(
        (way.format(asked), f"{rate:.0f}", f"{rate / bare:.2f}") for way, rate in rates.items()
    )
    notes = (
        f"Median of {len(next(iter(found.values())))} rounds; target {RATE_TARGET:g} over REST: "
        f"{met(rest >= RATE_TARGET * bare)}. All files are equal, byte for byte.",
        f"Starting the workers: {start_seconds:.1f} s.",
    )
    return Table("study", (f"{count} runs of 7 s, varied", "runs/s", "ratio"), rows, notes)


def _tabulate_answers(count: int, load: Load, peak: int) -> Table:
    slowest = load.percentile(95)
    notes = (
        f"All together: 95th percentile {MILLISECONDS * slowest:.0f} ms; target "
        f"{MILLISECONDS * ANSWER_TARGET:.0f} ms: {met(slowest < ANSWER_TARGET)}.",
        f"Service and workers together took {peak / 1e6:.0f} MB at most; target "
        f"{MEMORY_TARGET / 1e6:.0f} MB: {met(peak < MEMORY_TARGET)}.",
    )
    rows = {
        kind: {
            "answers": str(len(times)),
            "median [ms]": f"{MILLISECONDS * np.median(times):.0f}",
            "95th percentile [ms]": f"{MILLISECONDS * np.percentile(times, 95):.0f}",
        }
        for kind, times in load.answers.items()
    }
    return table_of_rows("study-answers", f"answers while {count} runs go on", rows, *notes)


def measure_large_study(count: int = 10_000) -> Table:
    """Memory while a study grows, and pages of its results after its end.

    Args:
        count: Number of runs of the study.
    """
    load = Load()
    with tempfile.TemporaryDirectory() as name, _watched(Path(name), load) as (service, samples):
        study, rate = run_over_rest(service, describe_study(count), load)
        pages = _time_pages(service, study, count)
        size = (Path(name) / "studies" / f"{study}.mcap").stat().st_size
        assert not list(Path(name).glob("*.mcap")), "a run was kept unasked"
    # Over the second half, after everything is loaded.
    half = [(done, memory) for done, memory in samples if count / 2 < done < count]
    done, memory = zip(*half, strict=True)
    slope = float(np.polyfit(done, memory, 1)[0])
    peak, answers = max(memory for _, memory in samples), MILLISECONDS * load.percentile(95)
    rows = (
        ("runs per second", f"{rate:.0f}"),
        ("95th percentile of the answers meanwhile [ms]", f"{answers:.0f}"),
        ("peak memory of service and workers [MB]", f"{peak / 1e6:.0f}"),
        ("memory per further run, second half [kB]", f"{slope / 1e3:.2f}"),
        ("file of the study, per run [B]", f"{size / count:.0f}"),
        *((f"{kind} [ms]", f"{MILLISECONDS * seconds:.0f}") for kind, seconds in pages.items()),
    )
    note = f"Target below {SLOPE_TARGET / 1e3:g} kB of memory per run: {met(slope < SLOPE_TARGET)}."
    return Table("study-large", (f"a study of {count} runs over REST", ""), rows, (note,))


def _time_pages(service: Service, study: str, count: int) -> dict[str, float]:
    """Median response time of requests about a finished study [s]."""
    results = f"{STUDIES}/{study}/results?limit=100"
    paths = {
        "list of studies": STUDIES,
        "first page of results": results,
        "last page of results": f"{results}&offset={count - 100}",
        "page sorted by a metric": f"{results}&sort=-slip_path_0&offset={count // 2}",
        "page of one outcome": f"{results}&outcome=completed",
        "summary": f"{STUDIES}/{study}/summary",
    }
    return {
        kind: statistics.median(service.seconds_of(path) for _ in range(PAGES))
        for kind, path in paths.items()
    }


if __name__ == "__main__":
    os.nice(NICENESS)
    bare_study = make_study(int(sys.argv[1]))
    scenarios = [bare_study.scenario_of(index) for index in range(bare_study.num_runs)]
    runs = simulate_many(scenarios, threads=WORKERS)
    next(runs)
    start = time.perf_counter()
    for _ in runs:
        pass
    print(time.perf_counter() - start)
