"""The dashboard in use: edits in a page, playback, many viewers, connecting and disconnecting."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.dashboard_page import measure_edits
from benchmarks.dashboard_viewers import come_and_go, watch
from benchmarks.processes import memory_of, processor_time_of
from benchmarks.report import Table, table_of_rows
from benchmarks.service import Service, serve
from benchmarks.timing import MILLISECONDS
from slipgrasp.server.memory import LOOK_SECONDS

PRESET, IN_SPACE = "paper-case-2", "spatial-prism"
_WARM_UP = 60
_FIRST, _SETTLE, _WATCH = 3.0, 10.0, 15.0


def run() -> list[Table]:
    """The tables ``dashboard-edits``, ``dashboard-viewers`` and ``dashboard-memory``."""
    return [tabulate_edits(), tabulate_viewers(), tabulate_memory()]


def tabulate_edits(edits: int = 50) -> Table:
    """Time from a key press on a slider to the last message of its run.

    Args:
        edits: Number of edits.
    """
    rows = []
    for preset in (PRESET, IN_SPACE):
        with serve_dashboard(preset) as served:
            come_and_go(served.socket, 1)
            times = MILLISECONDS * np.array(measure_edits(served.url, edits))
        for q in (50, 95):
            cells = (f"{time:.0f}" for time in np.percentile(times, q, axis=0))
            rows.append((f"{preset}, {q}th percentile", *cells))
    note = "Chromium, 1440 x 900, rendered without a graphics card."
    heads = (f"{edits} edits of the mass", "message in the page [ms]", "taken by the page [ms]")
    return Table("dashboard-edits", heads, tuple(rows), (note,))


def tabulate_viewers(
    counts: tuple[int, ...] = (1, 5, 20), counts_in_space: tuple[int, ...] = (1, 5)
) -> Table:
    """Update rate, age and cost while viewers watch the playback of a run.

    Args:
        counts: Numbers of viewers, one row each.
        counts_in_space: Numbers of viewers of a spatial hand.
    """
    rows = {}
    for preset, numbers in ((PRESET, counts), (IN_SPACE, counts_in_space)):
        with serve_dashboard(preset) as served:
            # What the first viewer loads is not counted for any.
            watch(served.socket, 1, 1.0, _FIRST, lambda: 0.0)
            rows |= {f"{preset}, {n}": _watch_row(served, n) for n in numbers}
    return table_of_rows("dashboard-viewers", "viewers, each its own session", rows)


def _watch_row(served: Service, count: int) -> dict[str, str]:
    settle, memory = _SETTLE + 0.5 * count, [memory_of(served.process.pid)]

    def look() -> float:
        memory.append(memory_of(served.process.pid))
        return processor_time_of(served.process.pid)

    seen, worked = watch(served.socket, count, settle, _WATCH, look)
    ages = np.concatenate([one.ages for one in seen])
    num_bytes = sum(one.num_bytes for one in seen)
    return {
        "updates/s of the slowest": f"{min(len(one.arrivals) for one in seen) / _WATCH:.1f}",
        "95th percentile of age [ms]": f"{MILLISECONDS * np.percentile(ages, 95):.0f}",
        "processor [% of a core]": f"{100.0 * worked / _WATCH:.0f}",
        "kB/s each": f"{num_bytes / count / _WATCH / 1e3:.0f}",
        "memory [MB each]": f"{(max(memory) - memory[0]) / count / 1e6:.1f}",
    }


def tabulate_memory(connects: int = 500) -> Table:
    """Memory after many viewers have connected and disconnected.

    Args:
        connects: Number of connections.
    """
    memory = []
    with serve_dashboard() as served:
        for times in (_WARM_UP, connects):
            come_and_go(served.socket, times)
            time.sleep(3.0 * LOOK_SECONDS)
            memory.append(memory_of(served.process.pid))
    before, after = memory
    rows = (
        (f"after {_WARM_UP} viewers that came and went", f"{before / 1e6:.0f}", ""),
        (f"after {connects} more", f"{after / 1e6:.0f}", f"{100 * (after / before - 1):+.1f} %"),
    )
    return Table("dashboard-memory", ("memory of the server", "MB", "change"), rows)


@contextmanager
def serve_dashboard(preset: str = PRESET) -> Iterator[Service]:
    """A context with a dashboard that has a separate data folder.

    Args:
        preset: Initial preset.
    """
    program = ("benchmarks.dashboard_server", preset)
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder), program) as service:
        yield service
