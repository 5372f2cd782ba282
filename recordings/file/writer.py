"""Writing recordings, during a run or afterwards."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from mcap.records import Schema
from numpy.typing import NDArray

from slipgrasp.core.run.provenance import Provenance, present_provenance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.signals import SIGNALS, TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.exceptions import (
    RecordingError,
    RecordingExistsError,
    RecordingWriteError,
)
from slipgrasp.recordings.file.atomic_file import PART_SUFFIX, atomic_file
from slipgrasp.recordings.file.chunks import ChunkWriter
from slipgrasp.recordings.file.container import McapContainer
from slipgrasp.recordings.file.documents import (
    PARAMETERS_ATTACHMENT,
    PROFILE,
    SCENARIO_ATTACHMENT,
    START,
    STOP,
    documents_hash,
    parameters_document,
    scenario_document,
    start_document,
    stop_document,
)
from slipgrasp.recordings.file.foxglove.layouts import (
    DISPLAY_RATE,
    DisplayLayout,
    FrameClock,
    display_layouts,
)
from slipgrasp.recordings.file.packing import MessageLayout
from slipgrasp.recordings.file.pieces import read_pieces
from slipgrasp.recordings.file.schemas import OWN_TOPICS, SCHEMA_VERSION, file_descriptor_set

CHUNK_BYTES = 1 << 18
MAX_PER_CHUNK = 4096

REGULAR_SUFFIX = ".regular.part"
"""Suffix of a file while it is rewritten in full chunks."""


def write_recording(
    result: RunResult,
    path: str | PathLike[str],
    *,
    overwrite: bool = False,
    display_rate: float = DISPLAY_RATE,
    part_suffix: str = PART_SUFFIX,
) -> None:
    """Writes a run as an MCAP file, completely or not at all.

    The bytes depend only on the run: the file has no wall clock time, host, path or id.

    Args:
        result: The run.
        path: The file to write.
        overwrite: Whether to replace an existing file.
        display_rate: Rate of the display topics, 0 for never [Hz].
        part_suffix: Suffix of the file until it is complete.

    Raises:
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingWriteError: If it cannot be written, or a number of the run is not finite.
    """
    with RecordingWriter(
        Path(path),
        result.scenario,
        result.trace.shape,
        provenance=result.provenance,
        overwrite=overwrite,
        display_rate=display_rate,
        part_suffix=part_suffix,
    ) as writer:
        writer.write(result.trace, result.phase_changes, result.ticks)
        writer.write_ending(result)


class RecordingWriter:
    """Writes one recording; an error in its ``with`` block leaves no complete file.

    Samples are buffered until they fill a chunk, so that equal runs give equal files for any
    sizes of the appended blocks. `flush` writes a chunk before it is full; the file is then
    rewritten in full chunks before it gets its final name.

    Args:
        path: The file to write.
        scenario: The scenario of the run; it is in the file before the first sample.
        shape: Shape of the samples to come.
        provenance: The program that computes the run; this process if None.
        overwrite: Whether to replace an existing file.
        display_rate: Rate of the display topics, 0 for never [Hz].
        part_suffix: Suffix of the file until it is complete.
        keep_part: Whether an error leaves the part that was written, for recovery.
    """

    def __init__(
        self,
        path: Path,
        scenario: Scenario,
        shape: TraceShape,
        *,
        provenance: Provenance | None = None,
        overwrite: bool = False,
        display_rate: float = DISPLAY_RATE,
        part_suffix: str = PART_SUFFIX,
        keep_part: bool = False,
    ) -> None:
        self._path = path
        self._scenario = scenario
        self._shape = shape
        self._provenance = provenance or present_provenance(scenario.space)
        self._overwrite = overwrite
        self._display_rate = display_rate
        self._part_suffix = part_suffix
        self._keep_part = keep_part
        self._rows = np.empty((0, shape.num_columns))
        self._changes: list[PhaseChange] = []
        self._ticks = np.empty((0, Ticks.num_columns(shape)))
        self.num_samples = 0
        self.num_phase_changes = 0
        self.num_ticks = 0
        self._is_regular = True
        self._result: RunResult | None = None

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            file = atomic_file(
                self._path,
                overwrite=self._overwrite,
                part_suffix=self._part_suffix,
                keep_part=self._keep_part,
                publish=self._publish,
            )
            self._stream = stack.enter_context(file)
            self._begin(self._stream)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    @property
    def samples_per_chunk(self) -> int:
        """The number of samples of a full chunk."""
        return max(1, CHUNK_BYTES // self._chunks.row_bytes)

    def write(
        self, trace: Trace, changes: Sequence[PhaseChange], ticks: Ticks | None = None
    ) -> None:
        """Appends samples, each as one message per topic, phase changes and ticks.

        Args:
            trace: The next samples.
            changes: The next phase changes, with the samples of their times.
            ticks: The next ticks, with the samples of their times; None if the run has none.

        Raises:
            RecordingWriteError: If a number is not finite.
        """
        rows = trace.to_rows()
        self._check_finite(rows, changes)
        self._rows = np.concatenate([self._rows, rows]) if len(self._rows) else rows
        self._changes += changes
        if ticks is not None:
            self._ticks = np.concatenate([self._ticks, ticks.to_rows()])
            self.num_ticks += len(ticks)
        self.num_samples += len(rows)
        self.num_phase_changes += len(changes)
        full = self.samples_per_chunk
        while len(self._rows) >= full:
            self._write_chunk(self._rows[:full])
            self._rows = self._rows[full:]
            self._stream.flush()

    def flush(self) -> None:
        """Writes buffered samples, so that they outlive this process; the chunk is not full."""
        if len(self._rows):
            self._is_regular = False
            self._write_chunk(self._rows)
            self._rows = self._rows[:0]
        self._stream.flush()

    def sync(self) -> None:
        """Syncs flushed samples to the disk, so that they outlive a power cut."""
        os.fsync(self._stream.fileno())

    def write_ending(self, result: RunResult) -> None:
        """Writes buffered samples and the outcome, and closes the file."""
        self._write_rest()
        by_channel = self._container.message_counts
        counts = {topic: by_channel[channel] for topic, channel in self._channels.items()}
        try:
            document = stop_document(result, counts, self._documents, self._chunks.state)
        except ValueError as error:
            raise RecordingWriteError(self._path, "a metric is not a finite number") from error
        self._container.add_metadata(STOP, document)
        self._container.finish()
        self._result = result

    def _publish(self, part: Path, path: Path) -> None:
        """Renames the file to its final name, in full chunks if it was flushed.

        If the process is killed meanwhile, the same file can be recovered from the part.
        """
        if self._result is None or self._is_regular:
            part.replace(path)
            return
        try:
            self._lay_out(part, path, self._result)
        except RecordingExistsError:
            raise  # Another writer was first.
        except RecordingError:
            # If the disk is full or fails, the existing file can be read as it is.
            part.replace(path)
        else:
            part.unlink()

    def _lay_out(self, part: Path, path: Path, result: RunResult) -> None:
        """Writes the content of the part in full chunks, without loading it completely."""
        with RecordingWriter(
            path,
            self._scenario,
            self._shape,
            provenance=self._provenance,
            overwrite=self._overwrite,
            display_rate=self._display_rate,
            part_suffix=REGULAR_SUFFIX,
        ) as writer:
            for piece in read_pieces(part):
                writer.write(piece.trace, piece.phase_changes, piece.ticks)
            writer.write_ending(result)

    def _begin(self, stream: BinaryIO) -> None:
        """Writes everything before the first sample."""
        library = f"slipgrasp {self._provenance.program}"
        self._container = McapContainer(stream, profile=PROFILE, library=library)
        seed = self._scenario.simulation.seed
        start = start_document(self._shape, self._provenance, seed, self._display_rate)
        self._container.add_metadata(START, start)
        scenario = scenario_document(self._scenario)
        self._container.add_attachment(SCENARIO_ATTACHMENT, "application/json", scenario)
        parameters = parameters_document(self._scenario)
        self._container.add_attachment(PARAMETERS_ATTACHMENT, "application/json", parameters)
        self._documents = documents_hash(start, scenario)
        display: tuple[DisplayLayout, ...] = ()
        if self._display_rate > 0.0:
            display = display_layouts(self._scenario, len(OWN_TOPICS) + 1)
        clock = FrameClock(self._display_rate)
        self._chunks = ChunkWriter(self._container, self._shape, self._documents, display, clock)
        self._channels: dict[str, int] = {}
        for layout in self._chunks.layouts.values():
            self._register_own(layout)
        for shown in display:
            self._register(shown.channel, shown.topic, shown.schema_name, shown.schema, {})
        self._stream.flush()

    def _register_own(self, layout: MessageLayout) -> None:
        topic = layout.topic
        texts = {field.name: field.text for field in topic.fields}
        metadata = {"schema_version": str(SCHEMA_VERSION), **texts}
        descriptors = file_descriptor_set(topic)
        self._register(layout.channel, topic.name, topic.schema_name, descriptors, metadata)

    def _register(
        self, number: int, topic: str, name: str, schema: bytes, metadata: dict[str, str]
    ) -> None:
        described = Schema(id=number, name=name, encoding="protobuf", data=schema)
        self._container.add_topic(topic, described, metadata)
        self._channels[topic] = number

    def _write_chunk(self, rows: NDArray[np.float64]) -> None:
        """Writes samples with the phase changes and ticks before the last of them.

        If these are too many for one chunk, each of several chunks has samples: recovery after a
        crash ends with the last complete chunk.
        """
        num_changes = sum(change.time < rows[-1, 0] for change in self._changes)
        num_ticks = int(np.searchsorted(self._ticks[:, 0], rows[-1, 0]))
        if len(rows) > 1 and max(num_changes, num_ticks) > MAX_PER_CHUNK:
            half = len(rows) // 2
            self._write_chunk(rows[:half])
            self._write_chunk(rows[half:])
            return
        changes, self._changes = self._changes[:num_changes], self._changes[num_changes:]
        ticks, self._ticks = self._ticks[:num_ticks], self._ticks[num_ticks:]
        while len(changes) > MAX_PER_CHUNK or len(ticks) > MAX_PER_CHUNK:
            self._chunks.write(rows[:0], changes[:MAX_PER_CHUNK], ticks[:MAX_PER_CHUNK])
            changes, ticks = changes[MAX_PER_CHUNK:], ticks[MAX_PER_CHUNK:]
        self._chunks.write(rows, changes, ticks)

    def _write_rest(self) -> None:
        if len(self._rows):
            self._write_chunk(self._rows)
        for start in range(0, max(len(self._changes), len(self._ticks)), MAX_PER_CHUNK):
            part = slice(start, start + MAX_PER_CHUNK)
            self._chunks.write(self._rows[:0], self._changes[part], self._ticks[part])

    def _check_finite(self, rows: NDArray[np.float64], changes: Sequence[PhaseChange]) -> None:
        if not np.isfinite(rows).all():
            trace = Trace.from_rows(self._shape, rows)
            (wrong, *_) = (s.name for s in SIGNALS if not np.isfinite(getattr(trace, s.name)).all())
            raise RecordingWriteError(self._path, f"{wrong} holds a number that is not finite")
        if not all(np.isfinite(change.time) for change in changes):
            raise RecordingWriteError(self._path, "a phase change has no finite time")
