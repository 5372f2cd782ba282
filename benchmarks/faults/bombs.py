"""Small or false files that would cost a trusting reader minutes or gigabytes."""

from __future__ import annotations

import json
import struct
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Schema
from numpy.typing import NDArray

from benchmarks.faults.damage import small_run
from benchmarks.memory import peak_memory
from benchmarks.processes import run_module
from benchmarks.report import Table
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file.chunks import ChunkWriter
from slipgrasp.recordings.file.container import MAGIC, McapContainer
from slipgrasp.recordings.file.documents import (
    PROFILE,
    SCENARIO_ATTACHMENT,
    START,
    STOP,
    documents_hash,
    scenario_document,
    start_document,
    stop_document,
)
from slipgrasp.recordings.file.foxglove.layouts import FrameClock
from slipgrasp.recordings.file.reader import read_recording, read_unfinished

READS = (read_recording, read_unfinished)
MAX_SECONDS = 1.0
MAX_MEGABYTES = 64.0
CHUNK = 1 << 23
DEEP = b"[" * 100_000 + b"]" * 100_000
FOREIGN = 77
NO_ROWS = np.empty((0, 0))

_MESSAGE = struct.Struct("<BQHIQQ")
_RECORD = struct.Struct("<BQ")


class Bomb:
    """An incomplete file that begins like a recording."""

    def __init__(self, stream: BinaryIO) -> None:
        scenario = load_scenario("paper-case-2")
        shape = TraceShape(2, tuple(estimate.parameter for estimate in scenario.estimates))
        self.container = McapContainer(stream, profile=PROFILE, library="bomb")
        self.start = start_document(shape, present_provenance(), 0, 0.0)
        self.container.add_metadata(START, self.start)
        self.container.add_attachment(
            SCENARIO_ATTACHMENT, "application/json", scenario_document(scenario)
        )


Make = Callable[[Bomb], bytes]
"""Completes a file; returns what is then appended, apart from its end."""


def _record(opcode: int, body: bytes, claimed: int | None = None) -> bytes:
    """Any record, which may state a false length."""
    return _RECORD.pack(opcode, len(body) if claimed is None else claimed) + body


def _chunk(content: bytes, claimed: int | None = None, level: int = 19) -> bytes:
    """A compressed chunk, which may state a false size."""
    data = zstandard.ZstdCompressor(level=level).compress(content)
    return _packed(data, len(content) if claimed is None else claimed, zlib.crc32(content))


def _packed(data: bytes, size: int, checksum: int) -> bytes:
    head = struct.pack("<QQQII4sQ", 0, 0, size, checksum, 4, b"zstd", len(data))
    return _record(Opcode.CHUNK, head + data)


def _wide_window(_bomb: Bomb) -> bytes:
    parameters = zstandard.ZstdCompressionParameters(window_log=27, compression_level=1)
    compressor = zstandard.ZstdCompressor(compression_params=parameters).compressobj()
    data = compressor.compress(bytes(CHUNK)) + compressor.flush()
    return _packed(data, CHUNK, 0) * 100


def _foreign_messages(bomb: Bomb) -> bytes:
    bomb.container.add_topic("/x", Schema(id=FOREIGN, name="x", encoding="", data=b""), {})
    message = _MESSAGE.pack(Opcode.MESSAGE, _MESSAGE.size - _RECORD.size, FOREIGN, 0, 0, 0)
    return _chunk(message * (CHUNK // len(message)), level=1) * 200


def _deep_documents(bomb: Bomb) -> bytes:
    documents = dict.fromkeys(("reason", "warnings", "metrics"), DEEP.decode())
    bomb.container.add_metadata(STOP, documents)
    return b""


def _long_numbers(bomb: Bomb) -> bytes:
    bomb.container.add_metadata(STOP, {"outcome": "completed", "reason": "9" * 900_000})
    return b""


def _many_changes(bomb: Bomb) -> bytes:
    scenario = load_scenario("paper-case-2").to_mapping()
    change = {"time": 1.0, "parameter": "object.mass", "value": 1.0}
    return _finish_run(bomb, json.dumps({**scenario, "changes": [change] * 15_000}).encode())


def _many_samples(bomb: Bomb) -> bytes:
    run = small_run()
    last = np.repeat(run.trace.to_rows()[-1:], 10_000, axis=0)
    return _finish_run(bomb, scenario_document(run.scenario), last, repeats=100)


def _many_phase_changes(bomb: Bomb) -> bytes:
    run = small_run()
    change = replace(run.phase_changes[-1], time=run.end_time)
    rows = run.trace.to_rows()[:0]
    return _finish_run(bomb, scenario_document(run.scenario), rows, [change] * 20_000, repeats=50)


def _finish_run(
    bomb: Bomb,
    scenario: bytes,
    rows: NDArray[np.float64] = NO_ROWS,
    changes: Sequence[PhaseChange] = (),
    repeats: int = 0,
) -> bytes:
    """A run with another scenario, and more samples and phase changes, with matching hashes."""
    run, container = small_run(), bomb.container
    container.add_attachment(SCENARIO_ATTACHMENT, "application/json", scenario)
    documents = documents_hash(bomb.start, scenario)
    chunks = ChunkWriter(container, run.trace.shape, documents, (), FrameClock(0.0))
    for layout in chunks.layouts.values():
        schema = Schema(id=layout.channel, name="", encoding="protobuf", data=b"")
        container.add_topic(layout.topic.name, schema, {})
    ticks = run.ticks.to_rows()
    chunks.write(run.trace.to_rows(), run.phase_changes, ticks)
    for _ in range(repeats):
        chunks.write(rows, changes, ticks[:0])
    by_channel = container.message_counts
    counts = {topic.name: by_channel[lay.channel] for topic, lay in chunks.layouts.items()}
    container.add_metadata(STOP, stop_document(run, counts, documents, chunks.state))
    return b""


def _huge_index(bomb: Bomb) -> bytes:
    bomb.container.finish()
    return bytes(1 << 26) + MAGIC


_SCHEMA = struct.pack("<HI1sI0sI", 1, 1, b"x", 0, b"", 0)
_CHANNEL = struct.pack("<HHI1sI0sI", 1, 0, 1, b"x", 0, b"", 0)
_INDEX = struct.pack("<HI", 1, 0)

BOMBS: dict[str, Make] = {
    "a chunk of 12 kB that inflates to 256 MiB": lambda _: _chunk(bytes(1 << 28), claimed=1000),
    "a chunk that claims to hold 1 GiB": lambda _: _chunk(bytes(1 << 20), claimed=1 << 30),
    "1000 chunks that inflate to 8 MiB of zeros each": lambda _: _chunk(bytes(CHUNK)) * 1000,
    "100 chunks that ask for a window of 128 MiB": _wide_window,
    "54 million messages of another program": _foreign_messages,
    "a million schemas": lambda _: _record(Opcode.SCHEMA, _SCHEMA) * 1_000_000,
    "a million channels": lambda _: _record(Opcode.CHANNEL, _CHANNEL) * 1_000_000,
    "a schema of 64 MiB": lambda _: _record(Opcode.SCHEMA, bytes(1 << 26)),
    "an attachment of 64 MiB": lambda _: _record(Opcode.ATTACHMENT, bytes(1 << 26)),
    "a record that claims 2^63 bytes": lambda _: _record(Opcode.METADATA, bytes(100), 1 << 63),
    "200 000 empty chunks": lambda _: _chunk(b"") * 200_000,
    "a million message indexes": lambda _: _record(Opcode.MESSAGE_INDEX, _INDEX) * 1_000_000,
    "an ending nested 100 000 deep": _deep_documents,
    "a scenario nested 100 000 deep": lambda bomb: _finish_run(bomb, DEEP),
    "a scenario of 15 000 timed changes": _many_changes,
    "a number of 900 000 digits": _long_numbers,
    "an index of 64 MiB": _huge_index,
}

WHOLE_BOMBS: dict[str, Make] = {
    "a million samples of a run of a few": _many_samples,
    "a million phase changes of a run of a few": _many_phase_changes,
}
"""Files whose start is retained by a reader that recovers valid parts."""


def write_bombs(folder: Path, bombs: Mapping[str, Make] = BOMBS) -> dict[str, Path]:
    """Writes every hostile file, each with a matching index and checksums."""
    paths = {}
    for i, (name, make) in enumerate(bombs.items()):
        paths[name] = folder / f"{i}.mcap"
        with paths[name].open("wb") as stream:
            bomb = Bomb(stream)
            stream.write(make(bomb))
            if make is not _huge_index:
                bomb.container.finish()
    return paths


def defuse(
    path: Path, reads: Sequence[Callable[[Path], object]] = READS
) -> tuple[float, float, list[str]]:
    """Reads a hostile file by several methods, in this process.

    Returns:
        The longer time [s], growth of the process's peak memory [MB], and the message.

    Raises:
        AssertionError: If it is read as a recording.
    """
    before, seconds, findings = peak_memory(), [], []
    for read in reads:
        started = time.perf_counter()
        try:
            read(path)
        except RecordingError as error:
            findings.append(str(error))
        seconds.append(time.perf_counter() - started)
    assert len(findings) == len(reads), f"{path} was read as a recording"
    return max(seconds), (peak_memory() - before) / 1e6, findings


def defuse_all() -> Table:
    """The table ``bombs``: every hostile file, each read in a separate process.

    Raises:
        AssertionError: If one is not rejected within the limits.
    """
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as other:
        rows = [_row(*file, 2) for file in write_bombs(Path(folder)).items()]
        rows += [_row(*file, 1) for file in write_bombs(Path(other), WHOLE_BOMBS).items()]
    note = f"All refused; limits: {MAX_SECONDS:g} s, {MAX_MEGABYTES:g} MB."
    heads = ("hostile file", "size [MB]", "refused after [s]", "memory [MB]")
    return Table("bombs", heads, tuple(rows), (note,))


def _row(name: str, path: Path, num_reads: int) -> tuple[str, ...]:
    answer = run_module("benchmarks.faults.bombs", str(path), str(num_reads))
    seconds, megabytes, findings = json.loads(answer)
    assert seconds < MAX_SECONDS and megabytes < MAX_MEGABYTES, (name, answer, findings)
    return name, f"{path.stat().st_size / 1e6:.2f}", f"{seconds:.3f}", f"{megabytes:.1f}"


if __name__ == "__main__":
    print(json.dumps(defuse(Path(sys.argv[1]), READS[: int(sys.argv[2])])))
