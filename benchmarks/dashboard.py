"""The dashboard in use: edits in a page, playback, many viewers, connecting and disconnecting."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.dashboard_page import measure_edits
from benchmarks.dashboard_viewers import come_and_go, watch
from benchmarks.processes import memory_of, processor_time_of
from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS
from slipgrasp.server.memory import LOOK_SECONDS

PRESET, IN_SPACE = "paper-case-2", "spatial-prism"
EDITS = 50
VIEWERS = 20
CONNECTS = 500
_WARM_UP = 60
_FIRST, _SETTLE, _WATCH = 3.0, 10.0, 15.0
_AFTER_LAST = 3.0 * LOOK_SECONDS


class Served(NamedTuple):
    """A dashboard in a separate process."""

    process: int
    port: int

    @property
    def page(self) -> str:
        """Address of its page."""
        return f"http://127.0.0.1:{self.port}/"

    @property
    def socket(self) -> str:
        """Address of its websocket."""
        return f"ws://127.0.0.1:{self.port}/"


def run(_docs: Path | None = None) -> list[Table]:
    """The tables ``dashboard-edits``, ``dashboard-viewers`` and ``dashboard-memory``."""
    return [tabulate_edits(), tabulate_viewers(), tabulate_memory()]


def tabulate_edits(edits: int = EDITS) -> Table:
    """Time from a key press on a slider to the last message of its run.

    Args:
        edits: Number of edits.
    """
    rows = [row for preset in (PRESET, IN_SPACE) for row in _edit_rows(preset, edits)]
    note = "Chromium, 1440 x 900, rendered without a graphics card."
    heads = (f"{edits} edits of the mass", "message in the page [ms]", "taken by the page [ms]")
    return Table("dashboard-edits", heads, tuple(rows), (note,))


def _edit_rows(preset: str, edits: int) -> Iterator[tuple[str, ...]]:
    with serve_dashboard(preset) as served:
        come_and_go(served.socket, 1)
        found = measure_edits(served.page, edits)
    both = [e.arrived for e in found], [e.handled for e in found]
    for q in (50, 95):
        times = (f"{MILLISECONDS * np.percentile(times, q):.0f}" for times in both)
        yield f"{preset}, {q}th percentile", *times


def tabulate_viewers(
    counts: tuple[int, ...] = (1, 5, VIEWERS), counts_in_space: tuple[int, ...] = (1, 5)
) -> Table:
    """Update rate, age and cost while viewers watch the playback of a run.

    Args:
        counts: Numbers of viewers, one row each.
        counts_in_space: Numbers of viewers of a spatial hand.
    """
    heads = (
        "viewers, each its own session",
        "updates/s of the slowest",
        "95th percentile of age [ms]",
        "processor [% of a core]",
        "kB/s each",
        "memory [MB each]",
    )
    rows = []
    for preset, numbers in ((PRESET, counts), (IN_SPACE, counts_in_space)):
        with serve_dashboard(preset) as served:
            # What the first viewer loads is not counted for any.
            watch(served.socket, 1, 1.0, _FIRST, lambda: 0.0)
            rows += [(f"{preset}, {n}", *_watch_row(served, n)) for n in numbers]
    return Table("dashboard-viewers", heads, tuple(rows))


def _watch_row(served: Served, count: int) -> tuple[str, ...]:
    settle, before, memory = _SETTLE + 0.5 * count, memory_of(served.process), [0]

    def look() -> float:
        memory.append(memory_of(served.process))
        return processor_time_of(served.process)

    seen, worked = watch(served.socket, count, settle, _WATCH, look)
    ages = np.concatenate([one.ages for one in seen])
    return (
        f"{min(len(one.arrivals) for one in seen) / _WATCH:.1f}",
        f"{MILLISECONDS * np.percentile(ages, 95):.0f}",
        f"{100.0 * worked / _WATCH:.0f}",
        f"{sum(one.num_bytes for one in seen) / count / _WATCH / 1e3:.0f}",
        f"{(max(memory) - before) / count / 1e6:.1f}",
    )


def tabulate_memory(connects: int = CONNECTS) -> Table:
    """Memory after many viewers have connected and disconnected.

    Args:
        connects: Number of connections.
    """
    with serve_dashboard() as served:
        come_and_go(served.socket, _WARM_UP)
        before = _memory_at_rest(served)
        come_and_go(served.socket, connects)
        after = _memory_at_rest(served)
    rows = (
        (f"after {_WARM_UP} viewers that came and went", f"{before / 1e6:.0f}", ""),
        (f"after {connects} more", f"{after / 1e6:.0f}", f"{100 * (after / before - 1):+.1f} %"),
    )
    return Table("dashboard-memory", ("memory of the server", "MB", "change"), rows)


def _memory_at_rest(served: Served) -> int:
    time.sleep(_AFTER_LAST)
    return memory_of(served.process)


@contextmanager
def serve_dashboard(preset: str = PRESET) -> Iterator[Served]:
    """A context with a dashboard that has a separate data folder.

    Args:
        preset: Initial preset.
    """
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.dashboard_server", folder, preset],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield Served(process.pid, int(process.stdout.readline()))
        finally:
            process.stdin.close()
            process.wait()
            process.stdout.close()
