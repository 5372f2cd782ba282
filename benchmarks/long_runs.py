"""Memory of the longest runs that a service accepts, with a figure of two such runs and readers.

Two recordings of the greatest length are made over REST; then two more such runs, a figure of the
first two and readers of all kinds run concurrently with health requests.
"""

from __future__ import annotations

import random
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.processes import background_threads, peak_of, watch
from benchmarks.report import Table, met, table_of_rows
from benchmarks.service import Service, serve
from benchmarks.soak.asking import Tally

PRESET = "spatial-box"
LONGEST = {"output 10 kHz": (200.0, 10_000.0), "600 s": (600.0, 3333.0)}
"""Duration and rate of output of the longest legal runs: two million samples [s, Hz]."""

READ = (
    "/runs/{run}/signals?names=slip,normal_force&t_from={start}&t_to={end}",
    "/runs/{run}/signals?names=times",
    "/runs/{run}/signals",
    "/runs/{run}/signals.csv",
    "/runs/{run}/signals.parquet",
    "/diff?a={first}&b={second}",
    "/runs",
)
"""Requests of the readers."""

CONTROL_PERIOD = 1e-4
READERS = 12
MEMORY_LIMIT = 1e9
HEALTH_LIMIT = 0.1

_POLL = 0.05


@dataclass(slots=True)
class LongRuns:
    """Results of the longest runs.

    Attributes:
        tally: Responses to readers and figures.
        samples: Number of samples of each of the four runs.
        outcomes: Number of runs by outcome.
        first_peak: Peak memory of the service while two runs were recorded [bytes].
        peak: Peak memory [bytes].
        figure_seconds: Drawing times of the figures [s].
        health: Response times of health requests [s].
    """

    tally: Tally
    samples: list[int] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    first_peak: int = 0
    peak: int = 0
    figure_seconds: list[float] = field(default_factory=list)
    health: list[float] = field(default_factory=list)


def run(seed: int = 34) -> list[Table]:
    """The table ``long-runs``."""
    found = {name: measure(*length, READERS, seed) for name, length in LONGEST.items()}
    return [_tabulate(found)]


def measure(duration: float, output_rate: float, readers: int, seed: int) -> LongRuns:
    """Records two runs, then two more together with a figure of the first two and readers.

    Args:
        duration: Duration of each run [s].
        output_rate: Samples per second [Hz].
        readers: Number of concurrent readers.
        seed: Seed of their requests, and of the masses of the objects.
    """
    draw = random.Random(seed)
    asked = [request_of(duration, output_rate, round(draw.uniform(0.2, 0.3), 4)) for _ in range(4)]
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder)) as service:
        found, process = LongRuns(Tally(service.address)), service.process.pid
        with watch(partial(service.seconds_of, "/health"), _POLL) as found.health:
            first = record(service, asked[:2])
            found.first_peak = peak_of(process)
            clients = [partial(_read, found.tally, first, seed + i) for i in range(readers)]
            with background_threads(*clients, partial(_draw, found, first)):
                second = record(service, asked[2:])
        for run_id in (*first, *second):
            found.outcomes[service.ask(f"/runs/{run_id}")["outcome"]] += 1
            # The start of the times of the run has their number.
            head = service.exchange(f"/runs/{run_id}/signals?names=times", keep=400).content
            found.samples.append(int(head.partition(b'"count":')[2].partition(b",")[0]))
        found.peak = peak_of(process)
    return found


def request_of(duration: float, output_rate: float, mass: float) -> dict[str, Any]:
    """A request for a run of an object of some mass [s, Hz, kg]."""
    values = {
        "simulation.duration": duration,
        "simulation.output_rate": output_rate,
        "simulation.max_steps": 100_000_000,
        "controller.control_period": CONTROL_PERIOD,
        "object.mass": mass,
    }
    return {"scenario": PRESET, "set": values}


def record(service: Service, requests: list[dict[str, Any]]) -> list[str]:
    """Requests runs at once, and waits until they have ended; returns their ids."""
    run_ids = [service.ask("/runs", body, "respond-async")["id"] for body in requests]
    for run_id in run_ids:
        service.run_after_end(run_id)
    return run_ids


def _read(tally: Tally, run_ids: list[str], seed: int, done: threading.Event) -> None:
    """Makes random requests until the runs end."""
    draw = random.Random(seed)
    while not done.is_set():
        run_id, start = draw.choice(run_ids), round(draw.uniform(0.0, 5.0), 2)
        first, second = run_ids
        path = draw.choice(READ)
        path = path.format(run=run_id, start=start, end=start + 1, first=first, second=second)
        _ask(tally, path)
        done.wait(draw.uniform(0.0, 1.0))


def _draw(found: LongRuns, run_ids: list[str], done: threading.Event) -> None:
    """Requests the figure repeatedly, at least once."""
    path = f"/diff/figure?a={run_ids[0]}&b={run_ids[1]}&format=png"
    while not found.figure_seconds or not done.is_set():
        started = time.perf_counter()
        if _ask(found.tally, path) == 200:
            found.figure_seconds.append(time.perf_counter() - started)


def _ask(tally: Tally, path: str) -> int:
    """Sends a request, which may be rejected with a reason; returns its status."""
    kind = path.partition("?")[0].rpartition("/")[2]
    return tally.ask(kind, "GET", path, range(200, 600), keep=1 << 16).status


def _tabulate(found: dict[str, LongRuns]) -> Table:
    rows = {
        name: {
            "samples": f"{min(each.samples)} … {max(each.samples)}",
            "two runs [MB]": f"{each.first_peak / 1e6:.0f}",
            "all [MB]": f"{each.peak / 1e6:.0f}",
            "health p95 [ms]": f"{1e3 * np.quantile(each.health, 0.95):.0f}",
            "figure [s]": f"{np.median(each.figure_seconds):.0f}",
            "ends of the runs": _counted(each.outcomes),
            "answers": _counted({" ".join(end): n for end, n in each.tally.counts.items()}),
            "refused without a reason": str(len(each.tally.faults)),
        }
        for name, each in found.items()
    }
    peak = max(each.peak for each in found.values())
    p95 = max(float(np.quantile(each.health, 0.95)) for each in found.values())
    note = (
        f"Target at most {MEMORY_LIMIT / 1e6:.0f} MB: {met(peak <= MEMORY_LIMIT)}; health "
        f"within {1e3 * HEALTH_LIMIT:.0f} ms: {met(p95 <= HEALTH_LIMIT)}."
    )
    return table_of_rows("long-runs", "longest runs", rows, note)


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} ×{count}" for name, count in sorted(counts.items()))
