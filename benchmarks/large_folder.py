"""A service with many recordings in its folder: start, lists, searches and memory.

`python -m benchmarks.large_folder [COUNT [FOLDER]]` fills a temporary folder, or uses one that it
filled before, and prints the table. Processor time of the service is printed next to wall time,
because other programs affect only the latter.
"""

from __future__ import annotations

import json
import os
import re
import statistics
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

from benchmarks.catalogue import enter_all, fill
from benchmarks.faults.services import start_service
from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS

COUNT = 100_000
ROUNDS = 15
SEARCHES = {
    "list, newest first": "",
    "search: one metric": "metric=slip_path_0%3C0.5",
    "search: text of one run": "text=run%2077",
    "search: text of no run": "text=nothing%20of%20this",
    "search: preset, tag, text and metric, by name": (
        "preset=paper-case-1&tag=odd&text=RUN%201&metric=slip_path_0%3C0.5&sort=name"
    ),
    "sorted by a metric": "sort=-slip_path_0",
}


def measure_large_folder(folder: Path, rounds: int = ROUNDS) -> Table:
    """Start, response times and memory of a service, with an existing index of the folder.

    Args:
        folder: A folder made by `fill`.
        rounds: Number of timings of each response.
    """
    count = enter_all(folder)
    began = time.perf_counter()
    service, url = start_service(folder)
    with service:
        try:
            seconds_to_start = time.perf_counter() - began
            rows = [("service answers", f"{seconds_to_start:.2f} s", "")]
            runs = f"{url}api/v1/runs?limit=100&"
            rows.append(_row("first list", service.pid, lambda: _get(runs), 1))
            for words, query in SEARCHES.items():
                answer = _row(words, service.pid, lambda query=query: _get(runs + query), rounds)
                rows.append(answer)
            rows.append(("resident memory", f"{_memory(service.pid) / 1e6:.0f} MB", ""))
        finally:
            service.terminate()
    return Table("large-folder", (f"{count} recordings", "wall", "processor"), tuple(rows), ())


def _row(words: str, pid: int, ask: Callable[[], None], rounds: int) -> tuple[str, str, str]:
    walls, costs = [], []
    for _ in range(rounds):
        spent, began = _processor_seconds(pid), time.perf_counter()
        ask()
        walls.append(MILLISECONDS * (time.perf_counter() - began))
        costs.append(MILLISECONDS * (_processor_seconds(pid) - spent))
    return words, f"{statistics.median(walls):.0f} ms", f"{statistics.mean(costs):.0f} ms"


def _get(url: str) -> None:
    with urllib.request.urlopen(url) as answer:
        assert json.load(answer)["unread"] == 0


def _processor_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def _memory(pid: int) -> int:
    """Peak resident memory so far [B]."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    found = re.search(r"VmHWM:\s*(\d+) kB", status)
    assert found is not None
    return 1024 * int(found[1])


def main(count: str = str(COUNT), folder: str = "") -> None:
    """Fills a folder if it is empty, and prints the table."""
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(folder or temporary)
        if not any(path.glob("*.mcap")):
            path.mkdir(exist_ok=True)
            fill(path, int(count))
        for row in measure_large_folder(path).rows:
            print(*row, sep=" | ")


if __name__ == "__main__":
    main(*sys.argv[1:3])
