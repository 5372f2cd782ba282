"""A service with many recordings in its folder: start, lists, searches and memory.

`python -m benchmarks.large_folder [COUNT [FOLDER]]` fills a temporary folder, or uses one that it
filled before, and prints the table. Processor time of the service is printed next to wall time,
because other programs affect only the latter.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.catalogue import enter_all, fill
from benchmarks.processes import peak_of, processor_time_of
from benchmarks.report import Table, format_text
from benchmarks.service import Service, serve
from benchmarks.timing import MILLISECONDS

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


def measure_large_folder(folder: Path, rounds: int = 15) -> Table:
    """Start, response times and memory of a service, with an existing index of the folder.

    Args:
        folder: A folder made by `fill`.
        rounds: Number of timings of each response.
    """
    count = enter_all(folder)
    began = time.perf_counter()
    with serve(folder) as service:
        rows = [("service answers", f"{time.perf_counter() - began:.2f} s", "")]
        rows.append(_row("first list", service, "", 1))
        rows += [_row(words, service, query, rounds) for words, query in SEARCHES.items()]
        rows.append(("resident memory", f"{peak_of(service.process.pid) / 1e6:.0f} MB", ""))
    return Table("large-folder", (f"{count} recordings", "wall", "processor"), tuple(rows))


def _row(words: str, service: Service, query: str, rounds: int) -> tuple[str, str, str]:
    walls, costs, process = [], [], service.process.pid
    for _ in range(rounds):
        spent, began = processor_time_of(process), time.perf_counter()
        assert service.ask(f"/runs?limit=100&{query}")["unread"] == 0
        walls.append(MILLISECONDS * (time.perf_counter() - began))
        costs.append(MILLISECONDS * (processor_time_of(process) - spent))
    return words, f"{statistics.median(walls):.0f} ms", f"{statistics.mean(costs):.0f} ms"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(sys.argv[2] if len(sys.argv) > 2 else temporary)
        if not any(path.glob("*.mcap")):
            path.mkdir(exist_ok=True)
            fill(path, int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
        print(format_text(measure_large_folder(path)))
