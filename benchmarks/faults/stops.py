"""Time until an endless run has ended and is stored after a stop request over REST."""

from __future__ import annotations

import json
import tempfile
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.services import LONG_RUN, POLL, start_service

LET_RUN = 0.3


def stop_runs(count: int) -> float:
    """Stops runs successively.

    Args:
        count: Number of runs.

    Returns:
        95th percentile of the time from the request to the stored recording [s].

    Raises:
        AssertionError: If one is not stored as ``stopped``.
    """
    with tempfile.TemporaryDirectory() as folder:
        service, url = start_service(Path(folder))
        with service:
            try:
                return float(np.quantile([_stop_one(url) for _ in range(count)], 0.95))
            finally:
                service.terminate()


def _stop_one(url: str) -> float:
    run = _ask(url, "runs", LONG_RUN)
    while _ask(url, "health")["running"] == 0:
        time.sleep(POLL)
    time.sleep(LET_RUN)
    began = time.perf_counter()
    _ask(url, f"runs/{run['id']}/stop", {})
    while "outcome" not in (found := _ask(url, f"runs/{run['id']}")):
        time.sleep(POLL)
    assert found["outcome"] == "stopped", found
    return time.perf_counter() - began


def _ask(url: str, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
    """A response, without waiting for a run."""
    data = None if body is None else json.dumps(body).encode()
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    with urllib.request.urlopen(
        urllib.request.Request(f"{url}api/v1/{path}", data, headers)
    ) as answer:
        found: dict[str, Any] = json.load(answer)
    return found
