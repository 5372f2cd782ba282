"""Peak memory of a batch without traces, in a new process for every number of runs.

`python -m benchmarks.memory RUNS` is such a process: it prints its peak in bytes.
"""

from __future__ import annotations

import re
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.batch import THREADS, vary
from benchmarks.report import Table
from slipgrasp import simulate_many

COUNTS = (1000, 3000, 10_000)
DURATION = 0.5  # [s]; a batch stores no trace, so that longer runs need no more memory
LIMIT = 500e6  # [B]

_ROOT = Path(__file__).parents[1]
_STATUS = Path("/proc/self/status")


def run(_docs: Path | None = None) -> list[Table]:
    """The table ``memory``."""
    return [_tabulate(COUNTS, [measure_memory(count) for count in COUNTS])]


def measure_memory(count: int) -> int:
    """Peak memory of a process that simulates a batch of a number of runs [B]."""
    command = [sys.executable, "-m", "benchmarks.memory", str(count)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=_ROOT)
    return int(done.stdout)


def peak_memory() -> int:
    """Peak resident memory of this process so far [B].

    On Linux not ``ru_maxrss``, which a process inherits there from its parent.
    """
    if not _STATUS.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = re.search(r"VmHWM:\s*(\d+) kB", _STATUS.read_text(encoding="ascii"))
    assert found is not None, "Linux reports the peak of every process"
    return 1024 * int(found[1])


def _tabulate(counts: Sequence[int], peaks: Sequence[int]) -> Table:
    rows = tuple(
        (str(count), f"{peak / 1e6:.0f}") for count, peak in zip(counts, peaks, strict=True)
    )
    growth = (peaks[-1] - peaks[0]) / (counts[-1] - counts[0])
    note = (
        f"Runs of {DURATION:g} s on {THREADS} threads. "
        f"Memory per further run: {growth / 1e3:.2f} kB; "
        f"target below {LIMIT / 1e6:.0f} MB: {'met' if max(peaks) < LIMIT else 'missed'}."
    )
    return Table("memory", ("runs", "peak [MB]"), rows, (note,))


def main() -> None:
    """Simulates a batch and prints its peak memory."""
    for _ in simulate_many(vary("paper-case-1", int(sys.argv[1]), DURATION), threads=THREADS):
        pass
    sys.stdout.write(f"{peak_memory()}\n")


if __name__ == "__main__":
    main()
