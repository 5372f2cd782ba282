"""From a run to its recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from core.result import RunResult
from core.scenario import Scenario
from core.trace import Trace, TraceShape
from core.types import PhaseChange
from recordings.atomic_file import atomic_file
from recordings.container import ChannelBlock, McapContainer
from recordings.documents import (
    PARAMETERS_ATTACHMENT,
    PROFILE,
    SCENARIO_ATTACHMENT,
    START,
    STOP,
    parameters_document,
    scenario_document,
    start_document,
    stop_document,
)
from recordings.exceptions import RecordingWriteError
from recordings.packing import MessageLayout
from recordings.schemas import (
    PHASE_CHANGES,
    SAMPLE_TOPICS,
    TIME_SIGNAL,
    Topic,
    file_descriptor_set,
    signals_of,
)
from recordings.versions import program_version

__all__ = ["RecordingWriter", "layouts_of", "write_recording"]

CHUNK_BYTES = 1 << 19


def write_recording(result: RunResult, path: Path, *, overwrite: bool = False) -> None:
    """Writes a run as an MCAP file, complete or not at all.

    Nothing but the run decides the bytes: no wall clock, host, path or id is inside.

    Args:
        result: The run.
        path: The file to write.
        overwrite: Whether an existing file is replaced.

    Raises:
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingWriteError: If it cannot be written, or a number of the run is not finite.
    """
    with RecordingWriter(path, result.scenario, result.trace.shape, overwrite=overwrite) as writer:
        writer.write_samples(result.trace)
        writer.write_phase_changes(result.phase_changes)
        writer.write_ending(result)


class RecordingWriter:
    """Writes one recording; leaving its ``with`` block by an error leaves no file.

    Args:
        path: The file to write.
        scenario: What decides the run; it stands in the file before the first sample.
        shape: Shape of the samples to come.
        overwrite: Whether an existing file is replaced.
    """

    def __init__(
        self, path: Path, scenario: Scenario, shape: TraceShape, *, overwrite: bool = False
    ) -> None:
        self._path = path
        self._scenario = scenario
        self._shape = shape
        self._overwrite = overwrite

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stream = stack.enter_context(atomic_file(self._path, overwrite=self._overwrite))
            self._begin(stream)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, traceback)

    def write_samples(self, trace: Trace) -> None:
        """Appends samples, each as one message per topic."""
        layouts = [self._layouts[topic] for topic in SAMPLE_TOPICS]
        row_type = np.dtype([(layout.topic.name, layout.record_type) for layout in layouts])
        rows_per_chunk = max(1, CHUNK_BYTES // row_type.itemsize)
        for start in range(0, len(trace), rows_per_chunk):
            rows = slice(start, start + rows_per_chunk)
            table = np.empty(len(trace.times[rows]), row_type)
            columns = [self._sample_columns(layout.topic, trace, rows) for layout in layouts]
            self._write_chunk(table, dict(zip(layouts, columns, strict=True)))

    def write_phase_changes(self, changes: Sequence[PhaseChange]) -> None:
        """Appends phase changes, one message each."""
        layout = self._layouts[PHASE_CHANGES]
        row_type = np.dtype([(PHASE_CHANGES.name, layout.record_type)])
        rows_per_chunk = CHUNK_BYTES // row_type.itemsize
        for start in range(0, len(changes), rows_per_chunk):
            block = changes[start : start + rows_per_chunk]
            columns = {
                "t": np.array([change.time for change in block]),
                "contact": np.array([change.contact for change in block]),
                "from_phase": np.array([change.from_phase for change in block]),
                "to_phase": np.array([change.to_phase for change in block]),
            }
            self._check_finite(columns)
            self._write_chunk(np.empty(len(block), row_type), {layout: columns})

    def write_ending(self, result: RunResult) -> None:
        """Writes how the run ended and closes the file; nothing can follow."""
        by_channel = self._container.message_counts
        counts = {t.name: by_channel[layout.channel] for t, layout in self._layouts.items()}
        try:
            document = stop_document(result, counts)
        except ValueError as error:
            raise RecordingWriteError(self._path, "a metric is not a finite number") from error
        self._container.add_metadata(STOP, document)
        self._container.finish()

    def _begin(self, stream: BinaryIO) -> None:
        """Writes everything that stands before the first sample."""
        library = f"slipgrasp {program_version()}"
        self._container = McapContainer(stream, profile=PROFILE, library=library)
        self._container.add_metadata(START, start_document(self._shape))
        scenario = scenario_document(self._scenario)
        self._container.add_attachment(SCENARIO_ATTACHMENT, "application/json", scenario)
        parameters = parameters_document()
        self._container.add_attachment(PARAMETERS_ATTACHMENT, "application/json", parameters)
        self._layouts = layouts_of(self._shape)
        for layout in self._layouts.values():
            self._register(layout)

    def _register(self, layout: MessageLayout) -> None:
        topic = layout.topic
        schema = Schema(
            id=layout.channel,
            name=topic.schema_name,
            encoding="protobuf",
            data=file_descriptor_set(topic),
        )
        channel = Channel(
            id=layout.channel,
            topic=topic.name,
            message_encoding="protobuf",
            schema_id=schema.id,
            metadata={field.name: field.text for field in topic.fields},
        )
        self._container.add_schema(schema)
        self._container.add_channel(channel)

    def _sample_columns(self, topic: Topic, trace: Trace, rows: slice) -> dict[str, NDArray[Any]]:
        columns = {signal.name: getattr(trace, signal.name)[rows] for signal in signals_of(topic)}
        columns["t"] = trace.times[rows]
        self._check_finite(columns)
        return columns

    def _check_finite(self, columns: Mapping[str, NDArray[Any]]) -> None:
        for name, values in columns.items():
            if not np.isfinite(values).all():
                shown = TIME_SIGNAL.name if name == "t" else name
                raise RecordingWriteError(self._path, f"{shown} holds a number that is not finite")

    def _write_chunk(
        self, table: NDArray[Any], columns: Mapping[MessageLayout, Mapping[str, NDArray[Any]]]
    ) -> None:
        """Fills a table with one column of message records per topic and writes it."""
        counts = self._container.message_counts
        rows = table.itemsize * np.arange(len(table), dtype=np.uint64)
        first_offset = 0
        blocks = []
        for layout, values in columns.items():
            records = table[layout.topic.name]
            layout.pack(records, values, first_sequence=counts[layout.channel])
            log_times = records["head"]["log_time"]
            blocks.append(ChannelBlock(layout.channel, log_times, rows + np.uint64(first_offset)))
            first_offset += records.itemsize
        self._container.add_chunk(table.tobytes(), blocks)


def layouts_of(shape: TraceShape) -> dict[Topic, MessageLayout]:
    """The message layouts of a recording, in the order of their channels."""
    layouts: dict[Topic, MessageLayout] = {}
    for channel, topic in enumerate((*SAMPLE_TOPICS, PHASE_CHANGES), start=1):
        widths = [1] * len(topic.fields)
        if topic is not PHASE_CHANGES:
            widths = [1, *(shape.width(signal) for signal in signals_of(topic))]
        layouts[topic] = MessageLayout(topic, channel, widths)
    return layouts
