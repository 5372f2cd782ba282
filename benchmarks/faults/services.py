"""SIGKILL of a service with two runs going on, and what its successor finds."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

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
    """What came of killed services.

    Attributes:
        count: How many were killed with two runs going on.
        recovered: How many runs their successors list as recovered.
        slowest: Longest time until a successor answered [s].
    """

    count: int
    recovered: int
    slowest: float


def kill_services(count: int, seed: int) -> ServiceKills:
    """Kills services while they record two runs, and starts another on the same folder.

    Args:
        count: How many.
        seed: Of how much they have recorded by then.

    Raises:
        AssertionError: If a run is not listed as recovered, with samples.
    """
    source = random.Random(seed)
    recovered, waits = 0, []
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            _kill_busy_service(Path(folder), source.uniform(0.3e6, 3e6))
            found, wait = _restart(Path(folder))
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


def _restart(folder: Path) -> tuple[list[dict[str, Any]], float]:
    """What a new service lists, and how long it took to answer [s]."""
    started = time.perf_counter()
    service, url = start_service(folder)
    with service:
        try:
            health = _get(url, "health")
            waited = time.perf_counter() - started
            while health["recovering"]:
                time.sleep(POLL)
                health = _get(url, "health")
            return _get(url, "runs")["data"], waited
        finally:
            service.terminate()


def _get(url: str, path: str) -> dict[str, Any]:
    with urllib.request.urlopen(f"{url}api/v1/{path}") as answer:
        found: dict[str, Any] = json.load(answer)
    return found


def start_service(
    folder: Path, log: IO[bytes] | int = subprocess.DEVNULL
) -> tuple[subprocess.Popen[str], str]:
    """A service on a folder, and its URL; it is ready."""
    command = [sys.executable, "-m", "slipgrasp", "serve", "--port", "0", "--data-dir", str(folder)]
    service = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    assert service.stdout is not None
    return service, service.stdout.readline().strip()


def _request_run(url: str) -> None:
    """Asks for a run, whose answer never comes."""
    body = json.dumps(LONG_RUN).encode()
    request = urllib.request.Request(
        f"{url}api/v1/runs", body, {"Content-Type": "application/json"}
    )
    with suppress(OSError), urllib.request.urlopen(request) as answer:
        answer.read()
