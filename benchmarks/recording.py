"""What surrounds a run: writing and reading its recording, and a change of a slider."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, median_seconds
from core.loading import load_scenario, with_values
from core.simulator import simulate
from recordings import read_recording, write_recording

__all__ = ["measure_recording", "run"]

ROUNDS = 15


def run(_docs: Path | None = None) -> list[Table]:
    """The table ``recording``."""
    return [measure_recording()]


def measure_recording(rounds: int = ROUNDS, duration: float = 7.0) -> Table:
    """CPU time around a run of the paper's case I, and the size of its recording.

    Args:
        rounds: How often each is timed.
        duration: Simulated time [s].
    """
    case = with_values(load_scenario("paper-case-1"), {"simulation.duration": duration})
    result = simulate(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        write_recording(result, path)
        size = path.stat().st_size
        works = {
            "write the recording": lambda: write_recording(result, path, overwrite=True),
            "read it back": lambda: read_recording(path),
            "validate a slider's change and simulate": lambda: simulate(
                with_values(case, {"object.mass": 1.2})
            ),
        }
        seconds = median_seconds(works, rounds)
    rows = tuple((name, f"{MILLISECONDS * own:.1f}") for name, own in seconds.items())
    note = (
        f"The recording takes {size / 1e3:.0f} kB, {size / duration / 1e3:.0f} kB per simulated "
        f"second; {len(result.trace)} rows."
    )
    return Table("recording", (f"{duration:g} s of case I", "CPU [ms]"), rows, (note,))
