"""Reads some signals of a time range of a recording, without decompressing the rest.

Every byte is compared with the checksum of the file, and decompressed chunks with their checksum.
Checks that need the whole run (its hash, and whether ending and metrics agree with its samples) are
in `slipgrasp.recordings.file.reader.read_recording`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from typing import BinaryIO

import numpy as np
from mcap.records import Chunk

from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.file.packing import MessageLayout
from slipgrasp.recordings.file.reader import Reading, TopicColumns, open_recording
from slipgrasp.recordings.file.scan import ChannelMessages
from slipgrasp.recordings.file.schemas import Topic, kept_fields, signals_in

_NANOSECONDS = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """Signals and times to read from a recording.

    Attributes:
        signals: Signals of the trace by name; times are always included.
        start: First time [s].
        end: Last time [s].
    """

    signals: frozenset[str]
    start: float = 0.0
    end: float = math.inf

    def may_be_in(self, chunk: Chunk) -> bool:
        """Whether a chunk may contain samples of the range; chunk times are integer nanoseconds."""
        first, last = chunk.message_start_time, chunk.message_end_time
        return last >= self.start * _NANOSECONDS - 1.0 and first <= self.end * _NANOSECONDS + 1.0


def read_outline(path: str | PathLike[str]) -> Trace:
    """A trace without rows, with the shape and signals of a recording.

    Raises:
        RecordingError: As in `read_recording`, if its start cannot be read.
    """
    with open_recording(path) as stream:
        shape, version = Reading(stream, str(path)).outline()
    missing = set(SIGNALS) - set(signals_in(version))
    absent = frozenset(signal.name for signal in missing if shape.has(signal))
    return replace(Trace.from_rows(shape, np.empty((0, shape.num_columns))), absent=absent)


def read_segment(
    path: str | PathLike[str],
    segment: Segment,
    should_stop: Callable[[], bool] = lambda: False,
) -> Trace:
    """Reads some signals of a time range of a recording.

    Args:
        path: The MCAP file.
        segment: Signals and times.
        should_stop: Called repeatedly; True stops the reading.

    Returns:
        The trace from the first to the last time, without the other signals.

    Raises:
        RecordingError: If it cannot be read, or a checksum does not match.
    """
    with open_recording(path) as stream:
        return _SegmentReading(stream, str(path), segment).contents(should_stop).trace()


class _SegmentReading(Reading):
    """One pass through a file that retains part of it."""

    def __init__(self, stream: BinaryIO, name: str, segment: Segment) -> None:
        super().__init__(stream, name, is_needed=segment.may_be_in)
        self._segment = segment
        self._next: Counter[int] = Counter()

    def _columns_for(self, topic: Topic, layout: MessageLayout) -> TopicColumns:
        return TopicColumns(layout, kept_fields(topic, self._segment.signals))

    def _take_messages(self, messages: ChannelMessages) -> None:
        self._check_amount()
        # Samples of skipped chunks are missing before these.
        self._check_order(messages, max(messages.sequences[0], self._next[messages.channel]))
        self._next[messages.channel] = messages.sequences[-1] + 1
        columns = self._channels[messages.channel]
        block = self._unpacked(messages, columns.layout)
        times = block["t"]
        inside = (times >= self._segment.start) & (times <= self._segment.end)
        columns.append({name: values[inside] for name, values in block.items()})
