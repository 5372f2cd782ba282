"""SIGKILL of processes that are writing a recording."""

from __future__ import annotations

import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import zstandard
from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_unfinished
from slipgrasp.recordings.file.recorder import record

_WRITER = """
import sys
from pathlib import Path
from benchmarks.faults.kills import long_scenario
from slipgrasp.recordings.file.recorder import record
record(long_scenario(float(sys.argv[2])), Path(sys.argv[1]))
"""

PATIENCE = 120.0
ATTEMPTS = 10
POLL = 0.002


def long_scenario(duration: float = 600.0) -> Scenario:
    """A run that takes seconds to simulate and writes continuously [s]."""
    values = {"simulation.duration": duration, "simulation.max_steps": 100_000_000}
    return with_values(load_scenario("paper-case-1"), values)


def kill_writers(count: int, seed: int, duration: float = 600.0) -> dict[str, Any]:
    """Kills processes at random moments between their first and their last chunk.

    Args:
        count: Number of processes.
        seed: Seed of the moments.
        duration: Simulated time of the run [s].

    Returns:
        Numbers of recordings: the ``count``, and those whose flushed samples were all
        ``readable``; ``fewest`` and ``most``, the numbers of samples.

    Raises:
        AssertionError: If a recording differs from the flushed samples.
    """
    whole = simulate(long_scenario(duration))
    source = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "whole.mcap"
        record(whole.scenario, file)
        size, left = size_of(file), []
        for i in range(count):
            part = _kill_writer(
                Path(folder) / f"{i}.mcap", duration, source.uniform(0.02, 0.9) * size
            )
            left.append(_check_what_is_left(part, whole))
            part.unlink()
    return {"count": count, "readable": len(left), "fewest": min(left), "most": max(left)}


def _kill_writer(path: Path, duration: float, at_size: float) -> Path:
    """Kills a process as soon as its file has a size; returns the file.

    Raises:
        AssertionError: If all of several processes ended before they were killed.
    """
    for _ in range(ATTEMPTS):
        if _is_killed_in_time(path, duration, at_size):
            return part_of(path)
        path.unlink(missing_ok=True)
    raise AssertionError("the writers end before they are killed")


def _is_killed_in_time(path: Path, duration: float, at_size: float) -> bool:
    """Whether a writer was still active when it was killed: this process may be too late."""
    part = part_of(path)
    command = [sys.executable, "-c", _WRITER, str(path), str(duration)]
    with subprocess.Popen(command) as writer:
        deadline = time.monotonic() + PATIENCE
        while writer.poll() is None and size_of(part) < at_size:
            assert time.monotonic() < deadline, "the writer does not write"
            time.sleep(POLL)
        writer.kill()
    return writer.returncode == -signal.SIGKILL and not path.exists()


def size_of(part: Path) -> int:
    """Its size [B]; 0 before it exists and after it has its final name."""
    try:
        return part.stat().st_size
    except FileNotFoundError:
        return 0


def _check_what_is_left(part: Path, whole: RunResult) -> int:
    """Compares our reading with that of the mcap library, and with the whole run."""
    flushed = _count_samples(part)
    result = read_unfinished(part).result
    assert len(result.trace) == flushed, f"{flushed} samples were flushed"
    assert result.trace.to_rows().tobytes() == whole.trace.to_rows()[:flushed].tobytes()
    changes = [change for change in whole.phase_changes if change.time < result.end_time]
    assert list(result.phase_changes) == changes
    return flushed


def _count_samples(part: Path) -> int:
    """Samples in complete chunks, by an independent reader, which fails at the cut."""
    found: dict[int, int] = {}
    with part.open("rb") as stream, suppress(McapError, struct.error, zstandard.ZstdError):
        for entry in StreamReader(stream, validate_crcs=True).records:
            if isinstance(entry, Message):
                found[entry.channel_id] = found.get(entry.channel_id, 0) + 1
    return found.get(1, 0)
