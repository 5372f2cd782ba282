"""Some signals of a segment of a recording, without unpacking the rest of it.

Every byte is read and compared with the checksum of the file, and what is unpacked with that of
its chunk. What only a whole run can show, its hash and whether ending and metrics follow from its
samples, is left to `slipgrasp.recordings.file.reader.read_recording`.
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
from slipgrasp.recordings.file.schemas import SAMPLE_TOPICS, TIME_SIGNAL, Topic, signals_in

_NANOSECONDS = 1e9
_TIME_FIELD = "t"


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """Signals and times to read from a recording.

    Attributes:
        signals: Signals of the trace by name; the times come with them in any case.
        start: First time [s].
        end: Last time [s].
    """

    signals: frozenset[str]
    start: float = 0.0
    end: float = math.inf

    def may_be_in(self, chunk: Chunk) -> bool:
        """Whether a chunk may hold samples of it; its own times are whole nanoseconds."""
        first, last = chunk.message_start_time, chunk.message_end_time
        return last >= self.start * _NANOSECONDS - 1.0 and first <= self.end * _NANOSECONDS + 1.0


def read_outline(path: str | PathLike[str]) -> Trace:
    """A trace without rows, of the shape and with the signals that a recording has.

    Raises:
        RecordingError: As `read_recording`, if not even its beginning can be read.
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
    """Reads some signals of a segment of a recording.

    Args:
        path: The MCAP file.
        segment: Signals and times.
        should_stop: Asked again and again whether nobody needs it any more.

    Returns:
        The trace from the first to the last time, in which all other signals are absent.

    Raises:
        RecordingError: If it cannot be read, or its checksums do not fit.
    """
    with open_recording(path) as stream:
        return _SegmentReading(stream, str(path), segment).contents(should_stop).trace()


class _SegmentReading(Reading):
    """One pass through a file that keeps a part of it."""

    def __init__(self, stream: BinaryIO, name: str, segment: Segment) -> None:
        super().__init__(stream, name, is_needed=segment.may_be_in)
        self._segment = segment
        self._next: Counter[int] = Counter()

    def _columns_for(self, topic: Topic, layout: MessageLayout) -> TopicColumns:
        wanted = self._segment.signals - {TIME_SIGNAL.name}
        kept = [field.name for field in topic.fields if field.name in wanted]
        # Every topic of samples has their times; where no other signal is read, the first will do.
        has_times = kept or (not wanted and topic.name == SAMPLE_TOPICS[0].name)
        return TopicColumns(layout, [_TIME_FIELD, *kept] if has_times else ())

    def _take_messages(self, messages: ChannelMessages) -> None:
        self._check_amount()
        # Those of chunks that were left out are missing before them.
        self._check_order(messages, max(messages.sequences[0], self._next[messages.channel]))
        self._next[messages.channel] = messages.sequences[-1] + 1
        columns = self._channels[messages.channel]
        block = self._unpacked(messages, columns.layout)
        times = block[_TIME_FIELD]
        inside = (times >= self._segment.start) & (times <= self._segment.end)
        columns.append({name: values[inside] for name, values in block.items()})
