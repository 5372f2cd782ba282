"""Peak memory of a batch without traces, in a new process for every number of runs.

`python -m benchmarks.memory RUNS` is such a process: it prints its peak in bytes.
"""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Sequence

from benchmarks.batch import THREADS, vary
from benchmarks.processes import peak_of, run_module
from benchmarks.report import Table, met
from slipgrasp import simulate_many

DURATION = 0.5  # [s]; a batch stores no trace, so that longer runs need no more memory
LIMIT = 500e6  # [B]


def run(counts: Sequence[int] = (1000, 3000, 10_000)) -> list[Table]:
    """The table ``memory``.

    Args:
        counts: Numbers of runs, in ascending order.
    """
    peaks = [measure_memory(count) for count in counts]
    rows = tuple(
        (str(count), f"{peak / 1e6:.0f}") for count, peak in zip(counts, peaks, strict=True)
    )
    growth = (peaks[-1] - peaks[0]) / (counts[-1] - counts[0])
    note = (
        f"Runs of {DURATION:g} s on {THREADS} threads. "
        f"Memory per further run: {growth / 1e3:.2f} kB; "
        f"target below {LIMIT / 1e6:.0f} MB: {met(max(peaks) < LIMIT)}."
    )
    return [Table("memory", ("runs", "peak [MB]"), rows, (note,))]


def measure_memory(count: int) -> int:
    """Peak memory of a process that simulates a batch of a number of runs [B]."""
    return int(run_module("benchmarks.memory", str(count)))


def peak_memory() -> int:
    """Peak resident memory of this process so far [B].

    On Linux not ``ru_maxrss``, which a process inherits there from its parent.
    """
    return peak_of(os.getpid()) or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    for _ in simulate_many(vary("paper-case-1", int(sys.argv[1]), DURATION), threads=THREADS):
        pass
    print(peak_memory())
