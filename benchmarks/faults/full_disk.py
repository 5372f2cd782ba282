"""A service whose disk is full, before or during a run."""

from __future__ import annotations

import json
import resource
import tempfile
import time
import urllib.error
import urllib.request
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from benchmarks.faults.services import start_service

SCENARIO = {"scenario": "paper-case-1", "set": {"simulation.output_rate": 1000.0}}
POLL = 0.1
BEFORE, DURING = 4096, 200_000
"""Largest size of a file: less than the part before the first sample, and less than a run."""


@dataclass(frozen=True, slots=True)
class FullDisk:
    """Responses to runs that did not fit on the disk.

    Attributes:
        refused: Number of responses with status 507.
        failed: Number of ``failed`` runs with the reason ``disk``.
        left: Number of recordings or parts that are left if no file could be created.
    """

    refused: int
    failed: int
    left: int


def fill_the_disk(runs: int) -> FullDisk:
    """Requests runs whose files cannot be created, and as many that are interrupted.

    Args:
        runs: Number of runs of each kind.

    Raises:
        AssertionError: If a response differs, or a service ends.
    """
    refused, left = _ask(BEFORE, runs)
    failed, _ = _ask(DURING, runs)
    assert refused == Counter({"507": runs}) and failed == Counter({"disk": runs})
    return FullDisk(refused["507"], failed["disk"], left)


def _ask(file_bytes: int, runs: int) -> tuple[Counter[str], int]:
    """Responses to runs with a limited file size, and the number of recordings left."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        service, url = start_service(folder)
        with service:
            try:
                _wait_for_the_kernel(url)
                resource.prlimit(service.pid, resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
                told = Counter(_answer(url) for _ in range(runs))
                assert service.poll() is None, "the service has ended"
            finally:
                service.terminate()
        return told, len(list(folder.glob("*.mcap*")))


def _wait_for_the_kernel(url: str) -> None:
    """The machine code of the kernel must also be written."""
    while True:
        with urllib.request.urlopen(f"{url}api/v1/health") as answer:
            if json.load(answer)["kernel"] == "ready":
                return
        time.sleep(POLL)


def _answer(url: str) -> str:
    """The status of a rejection, or the code of the reason of a run."""
    body = json.dumps(SCENARIO).encode()
    kind = {"Content-Type": "application/json", "Prefer": "wait=60"}
    request = urllib.request.Request(f"{url}api/v1/runs", body, kind)
    try:
        with urllib.request.urlopen(request) as answer:
            run = json.load(answer)
    except urllib.error.HTTPError as error:
        return str(error.code)
    return str((run["reason"] or {}).get("code", run["outcome"]))
