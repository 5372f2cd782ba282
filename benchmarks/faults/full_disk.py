"""A service whose disk takes no more, before a run begins or while it goes on."""

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
"""How large a file may become: less than what stands before the first sample, and than a run."""


@dataclass(frozen=True, slots=True)
class FullDisk:
    """The answers to runs that did not fit on the disk.

    Attributes:
        refused: How many with 507.
        failed: How many as ``failed``, with the reason ``disk``.
        left: Recordings, whole or begun, that are left where nothing could be begun.
    """

    refused: int
    failed: int
    left: int


def fill_the_disk(runs: int) -> FullDisk:
    """Asks services for runs whose files cannot be begun, and for as many that are cut off.

    Args:
        runs: How many of each kind.

    Raises:
        AssertionError: If one is answered in any other way, or a service does not stay up.
    """
    refused, left = _ask(BEFORE, runs)
    failed, _ = _ask(DURING, runs)
    assert refused == Counter({"507": runs}) and failed == Counter({"disk": runs})
    return FullDisk(refused["507"], failed["disk"], left)


def _ask(file_bytes: int, runs: int) -> tuple[Counter[str], int]:
    """How runs are answered if no file may become larger, and how many recordings are left."""
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
    """What the kernel is compiled to has to be written, too."""
    while True:
        with urllib.request.urlopen(f"{url}api/v1/health") as answer:
            if json.load(answer)["kernel"] == "ready":
                return
        time.sleep(POLL)


def _answer(url: str) -> str:
    """The status of a refusal, or the code of the reason of a run."""
    body = json.dumps(SCENARIO).encode()
    kind = {"Content-Type": "application/json", "Prefer": "wait=60"}
    request = urllib.request.Request(f"{url}api/v1/runs", body, kind)
    try:
        with urllib.request.urlopen(request) as answer:
            run = json.load(answer)
    except urllib.error.HTTPError as error:
        return str(error.code)
    return str((run["reason"] or {}).get("code", run["outcome"]))
