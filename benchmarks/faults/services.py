"""SIGKILL of a service that records, and recovery by its successor."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_unfinished
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.recovery import RECORDING_SUFFIX

RUNS = 2
PATIENCE = 120.0
POLL = 0.01
LONG_RUN = {
    "scenario": "paper-case-1",
    "set": {
        "simulation.duration": 600.0,
        "controller.control_period": 0.0001,
        "simulation.max_steps": 100_000_000,
    },
}


@dataclass(frozen=True, slots=True)
class ServiceKills:
    """Recovery after killed services.

    Attributes:
        count: Number of services killed during two runs.
        recovered: Number of runs that their successors list as recovered.
        slowest: Longest time until a successor responded [s].
    """

    count: int
    recovered: int
    slowest: float


def kill_services(count: int, seed: int) -> ServiceKills:
    """Kills services while they record two runs, and starts others on the same folder.

    Args:
        count: Number of them.
        seed: Seed of the recorded length.

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
    return ServiceKills(count, recovered, max(waits))


def _kill_busy_service(folder: Path, at_size: float) -> None:
    service, url = start_service(folder)
    with service:
        clients = [threading.Thread(target=_request_run, args=(url,)) for _ in range(RUNS)]
        for client in clients:
            client.start()
        deadline = time.monotonic() + PATIENCE
        while sum(part.stat().st_size > at_size for part in folder.glob("*.part")) < RUNS:
            assert time.monotonic() < deadline, "the runs are not recorded"
            time.sleep(POLL)
        service.kill()
    for client in clients:
        client.join()
    assert service.returncode == -signal.SIGKILL
    assert not list(folder.glob(f"*{RECORDING_SUFFIX}")), "a run had ended before the kill"


@dataclass(frozen=True, slots=True)
class Restart:
    """A service that finds many large unfinished recordings.

    Attributes:
        count: Number of them.
        size: Size of each [bytes].
        empty: Time until the first response without recordings [s].
        waited: Time until the first response with them [s].
        slowest: Longest response time during recovery [s].
        seconds: Until all were recovered [s].
    """

    count: int
    size: int
    empty: float
    waited: float
    slowest: float
    seconds: float


def restart_with_unfinished(count: int, duration: float) -> Restart:
    """Kills a service, and starts another that finds unfinished recordings.

    Args:
        count: Number of them.
        duration: Recorded duration of each [s]; one second gives 4.2 MB.

    Raises:
        AssertionError: If one is not recovered with all its samples.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        service, _ = start_service(folder)
        with service:
            service.kill()
        _, empty, _ = _recover_all(folder)
        end, size = _leave_unfinished(folder, count, duration)
        began = time.perf_counter()
        found, waited, answers = _recover_all(folder)
        seconds = time.perf_counter() - began
        assert [run["outcome"] for run in found] == ["recovered"] * count, found
        assert {run["end_time"] for run in found} == {end}
        return Restart(count, size, empty, waited, max(answers), seconds)


def _leave_unfinished(folder: Path, count: int, duration: float) -> tuple[float, int]:
    """Copies of a truncated recording; the time of its last sample [s], and its size."""
    values = {"simulation.output_rate": 10_000.0, "simulation.duration": duration}
    first = folder / f"{0:012d}{RECORDING_SUFFIX}"
    record(with_values(load_scenario("paper-case-1"), values), first)
    part = part_of(first)
    first.rename(part)
    size = part.stat().st_size * 19 // 20
    os.truncate(part, size)
    for i in range(1, count):
        shutil.copy(part, part_of(folder / f"{i:012d}{RECORDING_SUFFIX}"))
    return read_unfinished(part).result.end_time, size


def _recover_all(folder: Path) -> tuple[list[dict[str, Any]], float, list[float]]:
    """The list of a service after recovery, and the times of its first and later responses [s]."""
    started = time.perf_counter()
    service, url = start_service(folder)
    with service:
        try:
            health = _get(url, "health")
            waited, answers = time.perf_counter() - started, []
            while health["recovering"] or not answers:
                time.sleep(POLL)
                asked = time.perf_counter()
                health = _get(url, "health")
                answers.append(time.perf_counter() - asked)
            return _get(url, "runs")["data"], waited, answers
        finally:
            service.terminate()


def _get(url: str, path: str) -> dict[str, Any]:
    with urllib.request.urlopen(f"{url}api/v1/{path}") as answer:
        found: dict[str, Any] = json.load(answer)
    return found


def start_service(
    folder: Path,
    log: IO[bytes] | int = subprocess.DEVNULL,
    environment: Mapping[str, str] | None = None,
) -> tuple[subprocess.Popen[str], str]:
    """A service on a folder that is ready, and its URL."""
    command = [sys.executable, "-m", "slipgrasp", "serve", "--port", "0", "--data-dir", str(folder)]
    service = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=log, text=True, env=environment
    )
    assert service.stdout is not None
    return service, service.stdout.readline().strip()


def _request_run(url: str) -> None:
    """Requests a run, without a response."""
    body = json.dumps(LONG_RUN).encode()
    request = urllib.request.Request(
        f"{url}api/v1/runs", body, {"Content-Type": "application/json"}
    )
    with suppress(OSError), urllib.request.urlopen(request) as answer:
        answer.read()
