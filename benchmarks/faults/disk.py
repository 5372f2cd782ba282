"""Disk failures while a recording is written, and power cuts."""

from __future__ import annotations

import errno
import io
import os
import random
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

from benchmarks.faults.damage import assert_prefix, count_recovered
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file import atomic_file, recorder
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.writer import write_recording

Clock = Callable[[], float]
Sizes = list[tuple[float, int]]

ERRORS = {"full": errno.ENOSPC, "broken": errno.EIO, "quota": errno.EDQUOT, "torn": errno.ENOSPC}
KINDS = tuple(ERRORS)
"""Kind of disk failure; a torn write writes half of the bytes before the disk is full."""


class FailingFile(io.FileIO):
    """A file whose k-th write and all later ones fail."""

    def __init__(self, descriptor: int, failing: int, kind: str) -> None:
        super().__init__(descriptor, "wb")
        self._left = failing
        self._kind = kind

    def write(self, data: Any) -> int:
        """Writes, or fails immediately or after half of the bytes."""
        self._left -= 1
        if self._left > 0:
            return super().write(data)
        if self._kind == "torn" and self._left == 0:
            return super().write(memoryview(data)[: len(data) // 2])
        number = ERRORS[self._kind]
        raise OSError(number, os.strerror(number))


def fail_every_write(duration: float = 60.0, step: int = 1) -> dict[str, Any]:
    """Makes every ``step``-th write of a run's recording fail, in each of four ways.

    Args:
        duration: Simulated time of the run [s].
        step: Interval between failing writes.

    Returns:
        Numbers of recordings: the ``count``, ``readable`` as a prefix, ``empty`` without a sample.

    Raises:
        AssertionError: If data that were written before cannot be read, or another recording is
            changed.
    """
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": duration})
    whole = simulate(scenario)
    left = []
    with tempfile.TemporaryDirectory() as folder:
        earlier = Path(folder) / "earlier.mcap"
        write_recording(whole, earlier)
        for kind in KINDS:
            number = 1
            while (samples := _fail_write(Path(folder), whole, number, kind)) is not None:
                left.append(samples)
                number += step
        assert_prefix(read_recording(earlier), whole)
    return {"count": len(left), "readable": sum(map(bool, left)), "empty": left.count(0)}


def _fail_write(folder: Path, whole: RunResult, number: int, kind: str) -> int | None:
    """Number of samples left after a write fails; None if there are fewer writes."""
    path = folder / "run.mcap"
    with growing_files(lambda descriptor: FailingFile(descriptor, number, kind)):
        try:
            recorded = record(whole.scenario, path)
        except RecordingError:
            return _left_of(path, whole)
    if recorded.failure is None:
        assert_prefix(read_recording(path), whole)
        path.unlink()
        return None
    assert recorded.result.outcome in (Outcome.FAILED, Outcome.COMPLETED)
    assert not path.exists(), "an incomplete file took its final name"
    return _left_of(path, whole)


def _left_of(path: Path, whole: RunResult) -> int:
    part = atomic_file.part_of(path)
    try:
        return count_recovered(part, whole)
    finally:
        part.unlink(missing_ok=True)


class SyncedFile(io.FileIO):
    """A file that records its size over time.

    Args:
        descriptor: Descriptor of the file.
        clock: Returns the time [s].
    """

    def __init__(self, descriptor: int, clock: Clock) -> None:
        super().__init__(descriptor, "wb")
        self._clock = clock
        self.sizes = Sizes()

    def write(self, data: Any) -> int:
        """Writes, and records the size."""
        written = super().write(data)
        self.sizes.append((self._clock(), self.tell()))
        return written


def cut_the_power(
    seed: int, moments: int = 200, duration: float = 300.0, clock: Clock = time.monotonic
) -> dict[str, Any]:
    """Drops unsynced data at random moments of a run.

    Args:
        seed: Seed of the moments.
        moments: Number of moments.
        duration: Simulated time of the run [s].
        clock: Clock of the recorder's writes and syncs [s].

    Returns:
        Number of ``moments``; ``loss``, the longest time before one of them that was lost [s].

    Raises:
        AssertionError: If more is lost than one interval between syncs.
    """
    looks: list[float] = []

    def look() -> float:
        looks.append(clock())
        return looks[-1]

    values = {
        "simulation.duration": duration,
        "controller.control_period": 0.0001,
        "simulation.max_steps": 100_000_000,
    }
    slow = with_values(load_scenario("paper-case-1"), values)
    written, synced = _watch_a_slow_run(slow, look)
    source = random.Random(seed)
    losses = []
    for _ in range(moments):
        cut = source.uniform(written[0][0], written[-1][0])
        safe = max((size for at, size in synced if at <= cut), default=0)
        lost = [at for at, size in written if at <= cut and size > safe]
        losses.append(cut - lost[0] if lost else 0.0)
    # Between two readings of the clock, during simulation or disk access, it cannot act.
    longest = max(later - earlier for earlier, later in pairwise(looks))
    assert max(losses) <= recorder.SYNC_INTERVAL + recorder.FLUSH_INTERVAL + 2 * longest
    return {"moments": moments, "loss": max(losses)}


def _watch_a_slow_run(scenario: Scenario, clock: Clock) -> tuple[Sizes, Sizes]:
    """Sizes of the file of a run over time, and the times at which they were synced."""
    opened, synced, real_sync = list[SyncedFile](), Sizes(), os.fsync

    def remember(descriptor: int) -> SyncedFile:
        opened.append(SyncedFile(descriptor, clock))
        return opened[-1]

    def sync(descriptor: int) -> None:
        size = opened[0].sizes[-1][1]
        real_sync(descriptor)
        synced.append((clock(), size))

    with (
        tempfile.TemporaryDirectory() as folder,
        growing_files(remember),
        patch.object(os, "fsync", sync),
        patch.object(recorder, "time", SimpleNamespace(monotonic=clock)),
    ):
        record(scenario, Path(folder) / "run.mcap")
    return opened[0].sizes, synced


def growing_files(make: Callable[[int], io.FileIO]) -> AbstractContextManager[object]:
    """A context in which every growing file is created by ``make``."""
    return patch.object(os, "fdopen", lambda descriptor, _: io.BufferedWriter(make(descriptor)))
