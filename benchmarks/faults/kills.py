"""SIGKILL of processes that are writing a recording."""

from __future__ import annotations

import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import zstandard
from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_unfinished
from slipgrasp.recordings.file.recorder import record

PRESET = "paper-case-1"
PATIENCE = 300.0
ATTEMPTS = 10


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
    values = {"simulation.duration": duration, "simulation.max_steps": 100_000_000}
    whole = simulate(with_values(load_scenario(PRESET), values))
    source = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "whole.mcap"
        record(whole.scenario, file)
        size, left = size_of(file), []
        for i in range(count):
            at_size = source.uniform(0.02, 0.9) * size
            part = _kill_writer(Path(folder) / f"{i}.mcap", values, at_size)
            left.append(_check_what_is_left(part, whole))
            part.unlink()
    return {"count": count, "readable": len(left), "fewest": min(left), "most": max(left)}


def _kill_writer(path: Path, values: Mapping[str, float], at_size: float) -> Path:
    """Kills a process as soon as its file has a size; returns the file.

    Raises:
        AssertionError: If all of several processes ended before they were killed.
    """
    part = part_of(path)
    for _ in range(ATTEMPTS):
        with start_run(path, values) as writer:
            wait_until(lambda w=writer: w.poll() is not None or size_of(part) >= at_size)
            writer.kill()
        if writer.returncode == -signal.SIGKILL and not path.exists():
            return part
        path.unlink(missing_ok=True)
    raise AssertionError("the writers end before they are killed")


def start_run(path: Path, values: Mapping[str, float]) -> subprocess.Popen[bytes]:
    """Starts `slipgrasp run` with the recording to write and values of the preset."""
    words = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
    command = [sys.executable, "-m", "slipgrasp", "run", PRESET, *words, "--output", str(path)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def wait_until(holds: Callable[[], bool], poll: float = 0.001) -> None:
    """Waits until a condition holds, for some minutes at most.

    Args:
        holds: Whether it holds.
        poll: Time between two calls [s].
    """
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "the run is not recorded"
        time.sleep(poll)


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
