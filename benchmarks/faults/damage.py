"""Truncated files, and files with one wrong bit."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_recording, read_unfinished
from slipgrasp.recordings.file.writer import RecordingWriter, write_recording

SAMPLES_PER_CHUNK = 3


def small_run() -> RunResult:
    """A run with a small file and two slips."""
    values = {"simulation.duration": 0.25, "simulation.output_rate": 50.0}
    return simulate(with_values(load_scenario("paper-case-2"), values))


def write_part(run: RunResult, path: Path, samples_per_chunk: int = SAMPLES_PER_CHUNK) -> bytes:
    """The file of a writer that is stopped before its end, in small chunks."""
    writer = RecordingWriter(path, run.scenario, run.trace.shape, keep_part=True)
    try:
        with writer:
            for start in range(0, len(run.trace), samples_per_chunk):
                piece = run.trace[start : start + samples_per_chunk]
                changes = run.phase_changes[writer.num_phase_changes :]
                writer.write(piece, [c for c in changes if c.time <= piece.times[-1]])
                writer.flush()
            raise InterruptedError
    except RecordingError:
        return part_of(path).read_bytes()


def cut_everywhere(step: int = 1) -> dict[str, Any]:
    """Truncates a finished and an unfinished file after every ``step``-th byte.

    Returns:
        Numbers of truncations: ``finished`` of a finished file, all rejected; ``prefixes`` of an
        unfinished file that gave a prefix of the run; ``empty``, rejected without a sample.

    Raises:
        AssertionError: If one is read with other content than was written.
    """
    run = small_run()
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole.mcap"
        write_recording(run, whole)
        data, part = whole.read_bytes(), write_part(run, Path(folder) / "part.mcap")
        file = Path(folder) / "cut.mcap"
        finished = [_read(file, data[:length], run) for length in range(0, len(data), step)]
        lengths = range(0, len(part), step)
        left = [_recover(file, part[:length], run) for length in lengths]
    assert not any(finished), "a file without its end was read as if it were whole"
    assert left == sorted(left), "a longer file gave less"
    prefixes, empty = sum(map(bool, left)), left.count(0)
    return {"finished": len(finished), "prefixes": prefixes, "empty": empty}


def flip_bits(count: int, seed: int) -> dict[str, Any]:
    """Flips single bits of a finished file at random.

    Returns:
        Numbers of files: the ``count``, ``refused``, ``identical`` when read, ``recovered``.

    Raises:
        AssertionError: If one is read with other content than was written.
    """
    run = small_run()
    source = random.Random(seed)
    found = {"count": count, "refused": 0, "identical": 0, "recovered": 0}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "flipped.mcap"
        write_recording(run, file)
        data = file.read_bytes()
        for _ in range(count):
            flipped = bytearray(data)
            flipped[source.randrange(len(data))] ^= 1 << source.randrange(8)
            found["identical" if _read(file, flipped, run) else "refused"] += 1
            found["recovered"] += _recover(file, flipped, run) > 0
    return found


def _read(file: Path, data: bytes | bytearray, run: RunResult) -> bool:
    """Whether it can be read, which must give the same run."""
    file.write_bytes(data)
    try:
        result = read_recording(file)
    except RecordingError:
        return False
    assert_prefix(result, run)
    assert len(result.trace) == len(run.trace)
    assert result.metrics == run.metrics
    return True


def _recover(file: Path, data: bytes | bytearray, run: RunResult) -> int:
    file.write_bytes(data)
    return count_recovered(file, run)


def count_recovered(file: Path, run: RunResult) -> int:
    """Number of recovered samples of a file, which must be a prefix of a run."""
    try:
        result = read_unfinished(file).result
    except RecordingError:
        return 0
    assert_prefix(result, run)
    return len(result.trace)


def assert_prefix(result: RunResult, whole: RunResult) -> None:
    """Checks that a run is a prefix of another, bit for bit."""
    rows = result.trace.to_rows()
    assert rows.tobytes() == whole.trace.to_rows()[: len(rows)].tobytes()
    assert result.phase_changes == whole.phase_changes[: len(result.phase_changes)]
    assert all(change.time <= result.end_time for change in result.phase_changes)
    assert result.scenario == whole.scenario
