"""Services that are killed while they record, must stop runs, or find their disk full."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import tempfile
import time
from collections import Counter
from contextlib import ExitStack, suppress
from functools import partial
from http.client import HTTPException
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.clients import long_run
from benchmarks.faults.kills import size_of, wait_until
from benchmarks.processes import background_threads
from benchmarks.service import POLL, Service, serve
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_unfinished
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.recovery import RECORDING_SUFFIX

RUNS = 2
LONG_RUN = {
    "scenario": "paper-case-1",
    "set": {
        "simulation.duration": 600.0,
        "controller.control_period": 0.0001,
        "simulation.max_steps": 100_000_000,
    },
}
LET_RUN = 0.3
FULL_RUN = {"scenario": "paper-case-1", "set": {"simulation.output_rate": 1000.0}}
BEFORE, DURING = 4096, 200_000
"""Largest size of a file: less than the part before the first sample, and less than a run."""


def kill_services(count: int, seed: int) -> dict[str, Any]:
    """Kills services while they record two runs, and starts others on the same folder.

    Args:
        count: Number of them.
        seed: Seed of the recorded length.

    Returns:
        The ``count``; ``recovered``, the number of runs that their successors list as recovered;
        ``slowest``, the longest time until a successor responded [s].

    Raises:
        AssertionError: If a run is not listed as recovered, with samples.
    """
    source = random.Random(seed)
    recovered, waits = 0, []
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            _kill_busy_service(Path(folder), source.uniform(0.3e6, 3e6))
            found, wait, _ = _recover_all(Path(folder))
            assert [run["outcome"] for run in found] == ["recovered"] * RUNS, found
            assert all(run["end_time"] > 0.0 for run in found)
            recovered += len(found)
            waits.append(wait)
    return {"count": count, "recovered": recovered, "slowest": max(waits)}


def _kill_busy_service(folder: Path, at_size: float) -> None:
    def request_run(service: Service, _ended: object) -> None:
        with suppress(OSError, HTTPException):
            service.exchange("/runs", LONG_RUN)

    with ExitStack() as clients, serve(folder, kill=True) as service:
        clients.enter_context(background_threads(*[partial(request_run, service)] * RUNS))
        wait_until(lambda: sum(size_of(p) > at_size for p in folder.glob("*.part")) == RUNS)
    assert service.process.returncode == -signal.SIGKILL
    assert not list(folder.glob(f"*{RECORDING_SUFFIX}")), "a run had ended before the kill"


def restart_with_unfinished(count: int, duration: float) -> dict[str, Any]:
    """Starts a service on a folder with large unfinished recordings.

    Args:
        count: Number of them.
        duration: Recorded duration of each [s]; one second gives 4.2 MB.

    Returns:
        The ``count`` and ``size`` of the recordings [MB]; ``empty``, the time until the first
        response without recordings, and ``waited`` with them [s]; ``slowest``, the longest response
        time during recovery [s]; ``seconds`` until all were recovered [s].

    Raises:
        AssertionError: If one is not recovered with all its samples.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _, empty, _ = _recover_all(folder)
        end, size = _leave_unfinished(folder, count, duration)
        began = time.perf_counter()
        found, waited, slowest = _recover_all(folder)
        seconds = time.perf_counter() - began
        assert [run["outcome"] for run in found] == ["recovered"] * count, found
        assert {run["end_time"] for run in found} == {end}
    times = {"empty": empty, "waited": waited, "slowest": slowest, "seconds": seconds}
    return {"count": count, "size": size / 1e6, **times}


def _leave_unfinished(folder: Path, count: int, duration: float) -> tuple[float, int]:
    """Copies of a truncated recording; the time of its last sample [s], and its size."""
    first = folder / f"{0:012d}{RECORDING_SUFFIX}"
    record(long_run(duration), first)
    part = part_of(first)
    first.rename(part)
    size = part.stat().st_size * 19 // 20
    os.truncate(part, size)
    for i in range(1, count):
        shutil.copy(part, part_of(folder / f"{i:012d}{RECORDING_SUFFIX}"))
    return read_unfinished(part).result.end_time, size


def _recover_all(folder: Path) -> tuple[list[dict[str, Any]], float, float]:
    """Runs of a service after recovery; times of its first and slowest other response [s]."""
    started = time.perf_counter()
    with serve(folder) as service:
        service.seconds_of("/health")
        waited, times = time.perf_counter() - started, []
        while not times or service.ask("/health")["recovering"]:
            time.sleep(POLL)
            times.append(service.seconds_of("/health"))
        return service.ask("/runs")["data"], waited, max(times)


def stop_runs(count: int) -> dict[str, Any]:
    """Stops endless runs successively.

    Args:
        count: Number of runs.

    Returns:
        The ``count``; ``p95``, the 95th percentile of the time from the request to the stored
        recording [s].

    Raises:
        AssertionError: If one is not stored as ``stopped``.
    """
    waits = []
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder)) as service:
        for _ in range(count):
            run_id = service.ask("/runs", LONG_RUN, "respond-async")["id"]
            while service.ask("/health")["running"] == 0:
                time.sleep(POLL)
            time.sleep(LET_RUN)
            began = time.perf_counter()
            service.ask(f"/runs/{run_id}/stop", {}, "respond-async")
            found = service.run_after_end(run_id)
            waits.append(time.perf_counter() - began)
            assert found["outcome"] == "stopped", found
    return {"count": count, "p95": float(np.quantile(waits, 0.95))}


def fill_the_disk(runs: int) -> dict[str, Any]:
    """Requests runs whose files cannot be created, and as many that are interrupted.

    Args:
        runs: Number of runs of each kind.

    Returns:
        Numbers of runs: ``all``, ``refused`` with status 507, ``failed`` with the reason ``disk``,
        and the recordings or parts that are ``left`` if no file could be created.

    Raises:
        AssertionError: If a response differs, or a service ends.
    """
    refused, left = _request_beyond(BEFORE, runs)
    failed, _ = _request_beyond(DURING, runs)
    assert refused == Counter({"507": runs}) and failed == Counter({"disk": runs})
    return {"all": 2 * runs, "refused": refused["507"], "failed": failed["disk"], "left": left}


def _request_beyond(file_bytes: int, runs: int) -> tuple[Counter[str], int]:
    """Endings of runs with a limited file size, and the number of recordings left."""
    told = Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        with serve(Path(folder)) as service:
            # The machine code of the kernel must also be written.
            while service.ask("/health")["kernel"] != "ready":
                time.sleep(POLL)
            resource.prlimit(service.process.pid, resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
            for _ in range(runs):
                answer = service.exchange("/runs", FULL_RUN, "wait=60")
                reason = answer.json.get("reason") or {}
                told[reason.get("code", str(answer.status))] += 1
            assert service.process.poll() is None, "the service has ended"
        return told, len(list(Path(folder).glob("*.mcap*")))
