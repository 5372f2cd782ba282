"""Writes chunks of messages to a recording, with checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.file.container import ChannelBlock, McapContainer
from slipgrasp.recordings.file.foxglove.layouts import DisplayLayout, FrameClock
from slipgrasp.recordings.file.packing import MessageLayout
from slipgrasp.recordings.file.schemas import (
    CHECKPOINTS,
    PHASE_CHANGES,
    SAMPLE_TOPICS,
    TICKS,
    Topic,
    format_of,
    own_topics,
    signals_of,
)
from slipgrasp.recordings.file.state_hash import StateHash
from slipgrasp.scene.states import states_of

Columns = Mapping[str, NDArray[Any]]


def layouts_of(shape: TraceShape, version: int) -> dict[Topic, MessageLayout]:
    """The layouts of the messages in a format, in the order of their channels."""
    layouts: dict[Topic, MessageLayout] = {}
    for channel, topic in enumerate(own_topics(version), start=1):
        widths = [field.width for field in topic.fields]
        if topic == TICKS:
            widths = list(Ticks.widths(shape))
        elif topic.name not in (PHASE_CHANGES.name, CHECKPOINTS.name):
            widths = [1, *(shape.width(signal) for signal in signals_of(topic))]
        layouts[topic] = MessageLayout(topic, channel, widths)
    return layouts


class ChunkWriter:
    """Writes chunks of samples, phase changes and ticks, each ending with a checkpoint.

    Args:
        container: Output container.
        shape: Shape of the samples.
        documents: Hash of the preceding documents.
        display: Layouts of the display topics.
        clock: Selects samples for the display topics.
    """

    def __init__(
        self,
        container: McapContainer,
        shape: TraceShape,
        documents: bytes,
        display: Sequence[DisplayLayout],
        clock: FrameClock,
    ) -> None:
        self._container = container
        self._display = display
        self._clock = clock
        self._shape = shape
        self._documents = np.frombuffer(documents, "<u8")
        self._state = StateHash()
        self.layouts = layouts_of(shape, format_of(shape))
        names = {topic.name for topic in SAMPLE_TOPICS}
        self._samples = [each for topic, each in self.layouts.items() if topic.name in names]
        self._row_type = np.dtype([(lay.topic.name, lay.record_type) for lay in self._samples])

    @property
    def row_bytes(self) -> int:
        """Size of the messages of one sample [bytes]."""
        return self._row_type.itemsize

    @property
    def state(self) -> bytes:
        """Hash of the written samples."""
        return self._state.digest()

    def write(
        self, rows: NDArray[np.float64], changes: Sequence[PhaseChange], ticks: NDArray[np.float64]
    ) -> None:
        """Writes one chunk.

        Args:
            rows: Samples in the form of `slipgrasp.core.trace.trace.Trace.to_rows`.
            changes: Phase changes.
            ticks: Ticks in the form of `slipgrasp.core.trace.ticks.Ticks.to_rows`.
        """
        chunk = _Chunk()
        times = [*(change.time for change in changes[-1:]), *ticks[-1:, 0].tolist()]
        time = max(times, default=0.0)
        if len(rows):
            time = rows[-1, 0]
            trace = Trace.from_rows(self._shape, rows)
            self._add_samples(chunk, trace)
            self._add_display(chunk, rows)
        if changes:
            self._add_one_by_one(chunk, PHASE_CHANGES, _columns_of_changes(changes))
        if len(ticks):
            columns = Ticks.from_rows(self._shape, ticks)
            self._add_one_by_one(chunk, TICKS, {"t": columns.times, **_lists_of(columns)})
        self._state.add_samples(rows)
        self._state.add_phase_changes(changes)
        self._state.add_ticks(ticks)
        self._add_one_by_one(
            chunk, CHECKPOINTS, self._checkpoint(time, len(rows), len(changes), len(ticks))
        )
        self._container.add_chunk(b"".join(chunk.parts), chunk.blocks)

    def _add_samples(self, chunk: _Chunk, trace: Trace) -> None:
        table = np.empty(len(trace), self._row_type)
        for layout in self._samples:
            columns = {s.name: getattr(trace, s.name) for s in signals_of(layout.topic)}
            columns["t"] = trace.times
            self._pack(layout, table[layout.topic.name], columns)
        chunk.add(table, {layout.topic.name: layout.channel for layout in self._samples})

    def _add_display(self, chunk: _Chunk, rows: NDArray[np.float64]) -> None:
        shown = self._clock.take(rows[:, 0]) if self._display else np.empty(0, np.intp)
        if len(shown) == 0:
            return
        # One copy of whole rows is cheaper than one per signal.
        states = states_of(Trace.from_rows(self._shape, rows[shown]))
        for layout in self._display:
            table = np.empty(len(shown), [(layout.topic, layout.record_type)])
            first = self._container.message_counts[layout.channel]
            layout.pack(table[layout.topic], states, first)
            chunk.add(table, {layout.topic: layout.channel})

    def _add_one_by_one(self, chunk: _Chunk, topic: Topic, columns: Columns) -> None:
        layout = self.layouts[topic]
        table = np.empty(len(columns["t"]), [(topic.name, layout.record_type)])
        self._pack(layout, table[topic.name], columns)
        chunk.add(table, {topic.name: layout.channel})

    def _pack(self, layout: MessageLayout, records: NDArray[Any], columns: Columns) -> None:
        layout.pack(records, columns, self._container.message_counts[layout.channel])

    def _checkpoint(self, time: float, samples: int, changes: int, ticks: int) -> Columns:
        counts = self._container.message_counts
        return {
            "t": np.array([time]),
            "samples": np.array([counts[self._samples[0].channel] + samples]),
            "phase_changes": np.array([counts[self.layouts[PHASE_CHANGES].channel] + changes]),
            "ticks": np.array([counts[self.layouts[TICKS].channel] + ticks]),
            "documents_hash": self._documents[None],
            "state_hash": np.frombuffer(self.state, "<u8")[None],
        }


class _Chunk:
    """The messages of a chunk during its assembly."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.blocks: list[ChannelBlock] = []
        self._size = 0

    def add(self, table: NDArray[Any], channels: Mapping[str, int]) -> None:
        """Adds a table of message records with one column per channel."""
        rows = self._size + table.itemsize * np.arange(len(table), dtype=np.uint64)
        offset = 0
        for name, channel in channels.items():
            records = table[name]
            log_times = records["head"]["log_time"]
            self.blocks.append(ChannelBlock(channel, log_times, rows + np.uint64(offset)))
            offset += records.dtype.itemsize
        self.parts.append(table.tobytes())
        self._size += table.nbytes


def _lists_of(ticks: Ticks) -> Columns:
    return {name: getattr(ticks, name) for name in ("commands", "estimates", "diagnostics")}


def _columns_of_changes(changes: Sequence[PhaseChange]) -> Columns:
    return {
        "t": np.array([change.time for change in changes]),
        "contact": np.array([change.contact for change in changes]),
        "from_phase": np.array([change.from_phase for change in changes]),
        "to_phase": np.array([change.to_phase for change in changes]),
    }
