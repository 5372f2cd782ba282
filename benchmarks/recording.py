"""Cost around a run: writing and reading its recording, and a change of a slider."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.report import Table, met
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE, FrameClock
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.file.writer import write_recording

MICROSECONDS = 1e6
TARGET = 15e-6


def run(rounds: int = 15, duration: float = 7.0) -> list[Table]:
    """The table ``recording``: CPU time around a run of case I, and the size of its recording.

    Args:
        rounds: Number of timings of each.
        duration: Simulated time [s].
    """
    case = with_values(load_scenario("paper-case-1"), {"simulation.duration": duration})
    result = simulate(case)
    with tempfile.TemporaryDirectory() as folder:
        path, bare = Path(folder) / "run.mcap", Path(folder) / "bare.mcap"
        write_recording(result, path)
        write_recording(result, bare, display_rate=0.0)
        size, bare_size = path.stat().st_size, bare.stat().st_size
        works = {
            "write the recording": lambda: write_recording(result, path, overwrite=True),
            "write it without display topics": lambda: write_recording(
                result, bare, overwrite=True, display_rate=0.0
            ),
            "read it back": lambda: read_recording(path),
            "hash its samples": lambda: state_hash(result),
            "simulate": lambda: simulate(case),
            "simulate and record at once": lambda: record(case, path, overwrite=True),
            "validate a slider's change and simulate": lambda: simulate(
                with_values(case, {"object.mass": 1.2})
            ),
        }
        seconds = median_seconds(works, rounds)
    rows = tuple((name, f"{MILLISECONDS * own:.1f}") for name, own in seconds.items())
    samples = len(result.trace)
    frames = len(FrameClock(DISPLAY_RATE).take(result.trace.times))
    bare_seconds = seconds["write it without display topics"]
    per_sample = bare_seconds / samples
    per_frame = (seconds["write the recording"] - bare_seconds) / frames
    notes = (
        f"Our own topics cost {MICROSECONDS * per_sample:.1f} us per stored sample "
        f"(target {MICROSECONDS * TARGET:g} us: {met(per_sample <= TARGET)}), the display topics "
        f"{MICROSECONDS * per_frame:.1f} us per frame at {DISPLAY_RATE:g} Hz.",
        f"The recording takes {size / 1e3:.0f} kB, {size / duration / 1e3:.0f} kB per simulated "
        f"second, without display topics {bare_size / 1e3:.0f} and "
        f"{bare_size / duration / 1e3:.0f} kB; {samples} rows, {frames} frames.",
    )
    return [Table("recording", (f"{duration:g} s of case I", "CPU [ms]"), rows, notes)]
