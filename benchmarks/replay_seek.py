"""Seeking in a recording of a minute: time from the slider to the messages of scene and charts."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.headless_viewer import HeadlessViewer, content_of, session_state
from benchmarks.report import Table
from benchmarks.service import serve
from benchmarks.timing import MILLISECONDS
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.writer import write_recording

_FIRST_SEEK = 0.5


def run(seeks: int = 300, duration: float = 60.0) -> list[Table]:
    """The table ``replay-seek``: time from the slider to the messages of scene and charts.

    Args:
        seeks: Number of random times.
        duration: Length of the recording [s].
    """
    case = with_values(load_scenario("paper-case-1"), {"simulation.duration": duration})
    result = simulate(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        write_recording(result, path)
        program = ("slipgrasp", "replay", str(path))
        with (
            serve(Path(folder) / "data", program) as service,
            HeadlessViewer(service.socket) as viewer,
        ):
            _open_whole_run(viewer)
            opened, waits = viewer.bytes_received, _seek(viewer, seeks, duration)
            sent = (viewer.bytes_received - opened) / seeks
    rows = [
        (f"{q}th percentile", f"{MILLISECONDS * np.percentile(waits, q):.1f}") for q in (50, 95)
    ]
    note = (
        f"{len(result.trace)} rows. A seek sends {sent / 1e3:.1f} kB; opening the recording sent "
        f"{opened / 1e3:.0f} kB."
    )
    heads = (f"seek in {duration:g} s of case I", "time [ms]")
    return [Table("replay-seek", heads, tuple(rows), (note,))]


def _open_whole_run(viewer: HeadlessViewer) -> None:
    """Waits for the recording, stops the play head and shows the whole run."""
    viewer.wait_for(lambda message: "Replay" in content_of(message))
    viewer.post(kind="choose-window", choice="whole run")
    viewer.post(kind="seek", time=_FIRST_SEEK)
    viewer.wait_for(lambda message: _time_told(message) == _FIRST_SEEK)


def _seek(viewer: HeadlessViewer, seeks: int, duration: float) -> list[float]:
    waits = []
    for target in np.random.default_rng(0).uniform(1.0, duration, seeks).round(2).tolist():
        start = time.perf_counter()
        viewer.post(kind="seek", time=target)
        # The scene is sent first, then the values of the charts, and the state of the session last.
        viewer.wait_for(lambda message, target=target: _time_told(message) == target)
        waits.append(time.perf_counter() - start)
        time.sleep(0.02)
    return waits


def _time_told(message: dict[str, Any]) -> float | None:
    """Time of the play head at rest, as stated by the session [s]."""
    state = session_state(content_of(message))
    return None if state is None or state["playing"] else state["time"]
