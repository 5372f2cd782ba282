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
from dataclasses import dataclass
from pathlib import Path

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


@dataclass(frozen=True, slots=True)
class Kills:
    """What came of killed writers.

    Attributes:
        count: How many were killed, all of them while they wrote.
        readable: Of how many every flushed sample was read.
        fewest: Least samples that were left.
        most: Most samples that were left.
    """

    count: int
    readable: int
    fewest: int
    most: int


def long_scenario(duration: float = 600.0) -> Scenario:
    """A run that takes seconds to simulate and writes all the time [s]."""
    values = {"simulation.duration": duration, "simulation.max_steps": 100_000_000}
    return with_values(load_scenario("paper-case-1"), values)


def kill_writers(count: int, seed: int, duration: float = 600.0) -> Kills:
    """Kills processes at random moments between their first and their last chunk.

    Args:
        count: How many.
        seed: Of the moments.
        duration: Simulated time of their run [s].

    Raises:
        AssertionError: If what one left is not what it flushed.
    """
    whole = simulate(long_scenario(duration))
    source = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        size = _size_of_whole(whole.scenario, Path(folder) / "whole.mcap")
        left = []
        for i in range(count):
            part = _kill_writer(
                Path(folder) / f"{i}.mcap", duration, source.uniform(0.02, 0.9) * size
            )
            left.append(_check_what_is_left(part, whole))
            part.unlink()
    return Kills(count, len(left), min(left), max(left))


def _size_of_whole(scenario: Scenario, path: Path) -> int:
    record(scenario, path)
    size = path.stat().st_size
    path.unlink()
    return size


def _kill_writer(path: Path, duration: float, at_size: float) -> Path:
    """Kills a process as soon as its file has a size; returns the file.

    Raises:
        AssertionError: If each of several processes had ended before it was killed.
    """
    for _ in range(ATTEMPTS):
        if _is_killed_in_time(path, duration, at_size):
            return part_of(path)
        path.unlink(missing_ok=True)
    raise AssertionError("the writers end before they are killed")


def _is_killed_in_time(path: Path, duration: float, at_size: float) -> bool:
    """Whether a writer was still at work when it was killed: we may wait for a processor."""
    part = part_of(path)
    command = [sys.executable, "-c", _WRITER, str(path), str(duration)]
    with subprocess.Popen(command) as writer:
        deadline = time.monotonic() + PATIENCE
        while writer.poll() is None and _size_of(part) < at_size:
            assert time.monotonic() < deadline, "the writer does not write"
            time.sleep(POLL)
        writer.kill()
    return writer.returncode == -signal.SIGKILL and not path.exists()


def _size_of(part: Path) -> int:
    """Its size [B]; none once it has its final name, or before it is there."""
    try:
        return part.stat().st_size
    except FileNotFoundError:
        return 0


def _check_what_is_left(part: Path, whole: RunResult) -> int:
    """Compares what we read with what the mcap library finds, and with the whole run."""
    flushed = _count_samples(part)
    result = read_unfinished(part).result
    assert len(result.trace) == flushed, f"{flushed} samples were flushed"
    assert result.trace.to_rows().tobytes() == whole.trace.to_rows()[:flushed].tobytes()
    changes = [change for change in whole.phase_changes if change.time < result.end_time]
    assert list(result.phase_changes) == changes
    return flushed


def _count_samples(part: Path) -> int:
    """Samples in complete chunks, by another reader than ours, which then meets the cut."""
    found: dict[int, int] = {}
    with part.open("rb") as stream, suppress(McapError, struct.error, zstandard.ZstdError):
        for entry in StreamReader(stream, validate_crcs=True).records:
            if isinstance(entry, Message):
                found[entry.channel_id] = found.get(entry.channel_id, 0) + 1
    return found.get(1, 0)
