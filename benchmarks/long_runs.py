"""Memory of the longest runs that a service accepts, with a figure of two such runs and readers.

Two recordings of the greatest length are made over REST; then two more such runs, a figure of the
first two and readers of all kinds run concurrently with health requests.
"""

from __future__ import annotations

import http.client
import json
import random
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from email.message import Message
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.clients import serve_logged
from benchmarks.report import Table

PRESET = "spatial-box"
LONGEST = {"output 10 kHz": (200.0, 10_000.0), "600 s": (600.0, 3333.0)}
"""Duration and rate of output of the longest legal runs: two million samples [s, Hz]."""

CONTROL_PERIOD = 1e-4
READERS = 12
MEMORY_LIMIT = 1e9
HEALTH_LIMIT = 0.1
SEED = 34

_API = "/api/v1"
_PATIENCE = 600.0
_POLL = 0.05

Address = tuple[str, int]


@dataclass(frozen=True, slots=True)
class LongRuns:
    """Results of the longest runs.

    Attributes:
        samples: Number of samples of each of the four runs.
        outcomes: Number of runs by outcome.
        first_peak: Peak memory of the service while two runs were recorded [bytes].
        peak: Peak memory [bytes].
        statuses: Number of responses to readers and figures by status.
        unexplained: Rejections without a problem document with a sentence.
        figure_seconds: Drawing times of the figures [s].
        health: Response times of health requests [s].
    """

    samples: list[int] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    first_peak: int = 0
    peak: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    unexplained: list[str] = field(default_factory=list)
    figure_seconds: list[float] = field(default_factory=list)
    health: list[float] = field(default_factory=list)


def run(_docs: Path | None = None, seed: int = SEED) -> list[Table]:
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
    found = LongRuns()
    peaks: list[int] = []
    with tempfile.TemporaryDirectory() as folder, serve_logged(Path(folder)) as (address, pid, _):
        with _watched_health(address, found.health):
            first = [post(address, body) for body in asked[:2]]
            await_runs(address, first)
            peaks.append(peak_of(pid))
            second = [post(address, body) for body in asked[2:]]
            done = threading.Event()
            clients = [
                threading.Thread(target=_read, args=(address, first, seed + i, done, found))
                for i in range(readers)
            ]
            clients.append(threading.Thread(target=_draw, args=(address, first, done, found)))
            for client in clients:
                client.start()
            await_runs(address, second)
            done.set()
            for client in clients:
                client.join()
        for run_id in (*first, *second):
            status, _, body = _ask(address, "GET", f"/runs/{run_id}")
            assert status == 200, body[:200]
            found.outcomes[json.loads(body)["outcome"]] += 1
            found.samples.append(_num_samples(address, run_id))
        peaks.append(peak_of(pid))
    return _with_peaks(found, peaks)


def _with_peaks(found: LongRuns, peaks: list[int]) -> LongRuns:
    return LongRuns(
        found.samples,
        found.outcomes,
        *peaks,
        found.statuses,
        found.unexplained,
        found.figure_seconds,
        found.health,
    )


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


def post(address: Address, body: dict[str, Any]) -> str:
    """Requests a run; returns its id."""
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    status, found, answer = _ask(address, "POST", "/runs", json.dumps(body), headers)
    assert status == 202, answer[:300]
    return found["Location"].rpartition("/")[2]


def await_runs(address: Address, run_ids: list[str]) -> None:
    """Waits until runs have ended."""
    for run_id in run_ids:
        while _ask(address, "GET", f"/runs/{run_id}", headers={"Prefer": "wait=10"})[0] == 202:
            pass


def _read(
    address: Address, run_ids: list[str], seed: int, done: threading.Event, found: LongRuns
) -> None:
    """Makes random requests about the long recordings until the runs end."""
    draw = random.Random(seed)
    while not done.is_set():
        run_id, start = draw.choice(run_ids), round(draw.uniform(0.0, 5.0), 2)
        path = draw.choice(
            [
                f"/runs/{run_id}/signals?names=slip,normal_force&t_from={start}&t_to={start + 1}",
                f"/runs/{run_id}/signals?names=times",
                f"/runs/{run_id}/signals",
                f"/runs/{run_id}/signals.csv",
                f"/runs/{run_id}/signals.parquet",
                f"/diff?a={run_ids[0]}&b={run_ids[1]}",
                "/runs",
            ]
        )
        _note(found, path, *_ask(address, "GET", path))
        done.wait(draw.uniform(0.0, 1.0))


def _draw(address: Address, run_ids: list[str], done: threading.Event, found: LongRuns) -> None:
    """Requests the figure repeatedly, at least once."""
    path = f"/diff/figure?a={run_ids[0]}&b={run_ids[1]}&format=png"
    while not found.figure_seconds or not done.is_set():
        started = time.perf_counter()
        status, headers, body = _ask(address, "GET", path)
        if status == 200:
            found.figure_seconds.append(time.perf_counter() - started)
        _note(found, path, status, headers, body)


def _note(found: LongRuns, path: str, status: int, headers: Message, body: bytes) -> None:
    kind = path.partition("?")[0].rpartition("/")[2]
    found.statuses[f"{kind} {status}"] += 1
    if status < 400:
        return
    is_told = headers.get("Content-Type") == "application/problem+json" and (
        " " in json.loads(body)["detail"]
    )
    if not is_told or (status == 503 and "Retry-After" not in headers):
        found.unexplained.append(f"{path}: {status} {body[:200]!r}")


def _num_samples(address: Address, run_id: str) -> int:
    """Number of samples of a recording, from the header of a response with its times."""
    path = f"{_API}/runs/{run_id}/signals?names=times"
    connection = http.client.HTTPConnection(*address, timeout=_PATIENCE)
    try:
        connection.request("GET", path)
        head = connection.getresponse().read(400)
        return int(head.partition(b'"count":')[2].partition(b",")[0])
    finally:
        connection.close()


@contextmanager
def _watched_health(address: Address, waits: list[float]) -> Iterator[None]:
    is_over = threading.Event()

    def watch() -> None:
        while not is_over.wait(_POLL):
            started = time.perf_counter()
            status, _, _ = _ask(address, "GET", "/health")
            assert status == 200
            waits.append(time.perf_counter() - started)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        yield
    finally:
        is_over.set()
        watcher.join()


def _ask(
    address: Address,
    method: str,
    path: str,
    body: str | None = None,
    headers: dict[str, str] | None = None,
) -> tuple[int, Message, bytes]:
    """Status, headers and start of a response, which is read completely."""
    connection = http.client.HTTPConnection(*address, timeout=_PATIENCE)
    try:
        connection.request(method, _API + path, body, headers or {})
        answer = connection.getresponse()
        start = answer.read(1 << 16)
        while answer.read(1 << 16):
            pass
        return answer.status, answer.headers, start
    finally:
        connection.close()


def peak_of(pid: int) -> int:
    """Peak resident memory of a process so far [bytes]."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def _tabulate(found: dict[str, LongRuns]) -> Table:
    heads = (
        "longest runs",
        "samples",
        "two runs [MB]",
        "all [MB]",
        "health p95 [ms]",
        "figure [s]",
        "ends of the runs",
        "answers",
        "refused without a reason",
    )
    rows = tuple(
        (
            name,
            f"{min(each.samples)} … {max(each.samples)}",
            f"{each.first_peak / 1e6:.0f}",
            f"{each.peak / 1e6:.0f}",
            f"{1e3 * np.quantile(each.health, 0.95):.0f}",
            f"{np.median(each.figure_seconds):.0f}",
            _counted(each.outcomes),
            _counted(each.statuses),
            str(len(each.unexplained)),
        )
        for name, each in found.items()
    )
    peak = max(each.peak for each in found.values())
    p95 = max(float(np.quantile(each.health, 0.95)) for each in found.values())
    note = (
        f"Target at most {MEMORY_LIMIT / 1e6:.0f} MB: {_judge(peak <= MEMORY_LIMIT)}; health "
        f"within {1e3 * HEALTH_LIMIT:.0f} ms: {_judge(p95 <= HEALTH_LIMIT)}."
    )
    return Table("long-runs", heads, rows, (note,))


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name} ×{count}" for name, count in sorted(counts.items()))


def _judge(holds: bool) -> str:
    return "met" if holds else "missed"
