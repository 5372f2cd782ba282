"""Reads a recording back to the run, bit for bit."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Metadata
from numpy.typing import NDArray

from slipgrasp.core.run.claims import contradictions_of
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.validation.control import MIN_CONTROL_PERIOD
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.recordings.exceptions import (
    AlteredRecordingError,
    ContradictoryRecordingError,
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    NoRunError,
    RecordingError,
    RecordingNotFoundError,
)
from slipgrasp.recordings.file.chunks import layouts_of
from slipgrasp.recordings.file.contents import Contents
from slipgrasp.recordings.file.documents import (
    MEASURED_PROFILE,
    PROFILE,
    SCENARIO_ATTACHMENT,
    START,
    STUDY_PROFILE,
    read_scenario,
    read_shape,
)
from slipgrasp.recordings.file.packing import MessageLayout, to_log_times
from slipgrasp.recordings.file.scan import ChannelMessages, RecordScanner
from slipgrasp.recordings.file.schemas import (
    CHECKPOINTS,
    PHASE_CHANGES,
    SAMPLE_TOPICS,
    TICKS,
    Topic,
)
from slipgrasp.recordings.file.versions import FORMAT_VERSION

LONGEST_RUN = 1e3
"""Longest simulation [s]."""

EVENTS_TO_SPARE = 20_000
"""Largest number of other samples than at output times and phase changes."""

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class ReadBack:
    """A run read from a file.

    Attributes:
        result: The run.
        is_unaltered: Whether its content matches its hashes.
    """

    result: RunResult
    is_unaltered: bool


@dataclass(frozen=True, slots=True, eq=False)
class Unfinished:
    """The readable part of an unfinished file.

    Attributes:
        result: The run so far, ``recovered`` unless only the index is missing.
        unread_bytes: Size of the unusable part [bytes].
        display_rate: Rate of its display topics [Hz].
    """

    result: RunResult
    unread_bytes: int
    display_rate: float


def read_recording(
    path: str | PathLike[str], *, should_stop: Callable[[], bool] = lambda: False
) -> RunResult:
    """Reads a recording back to the original run.

    Args:
        path: The MCAP file.
        should_stop: Called repeatedly; True stops the reading.

    Returns:
        The run: scenario, trace (bit for bit), phase changes, outcome, reason, warnings
        and metrics.

    Raises:
        RecordingNotFoundError: If the file does not exist.
        ForeignRecordingError: If another program wrote it.
        NewerRecordingError: If a newer version of this program wrote it.
        DamagedRecordingError: If it is incomplete or changed, or states an ending, phase changes or
            metrics that contradict its samples.
        RecordingError: If it cannot be opened, or reading it was stopped.
    """
    result = read_as_stated(path, should_stop)
    if found := contradictions_of(result):
        raise ContradictoryRecordingError(str(path), found)
    return result


def read_as_stated(
    path: str | PathLike[str], should_stop: Callable[[], bool] = lambda: False
) -> RunResult:
    """Reads a recording even if its statements contradict its samples.

    Raises:
        RecordingError: As in `read_recording` otherwise.
    """
    read = read_back(path, should_stop)
    if not read.is_unaltered:
        raise AlteredRecordingError(str(path))
    return read.result


def read_back(
    path: str | PathLike[str], should_stop: Callable[[], bool] = lambda: False
) -> ReadBack:
    """Reads a recording even if it was altered with correct checksums.

    Raises:
        RecordingError: As in `read_recording`.
    """
    with open_recording(path) as stream:
        contents = Reading(stream, str(path)).contents(should_stop)
        return ReadBack(contents.result(), contents.is_unaltered())


def read_unfinished(path: str | PathLike[str]) -> Unfinished:
    """Reads a file as far as it is valid.

    It may still be written, or be unfinished because its process was killed.

    Raises:
        RecordingNotFoundError: If the file does not exist.
        ForeignRecordingError: If another program wrote it.
        NewerRecordingError: If a newer version of this program wrote it.
        DamagedRecordingError: If its start is damaged.
        RecordingError: If it cannot be opened, or contains no sample.
    """
    with open_recording(path) as stream:
        reading = Reading(stream, str(path), unfinished=True)
        contents = reading.contents()
        unread_bytes = os.fstat(stream.fileno()).st_size - reading.whole_bytes
        return Unfinished(contents.result_so_far(), unread_bytes, contents.display_rate)


@contextmanager
def open_recording(path: str | PathLike[str]) -> Iterator[BinaryIO]:
    """Opens a file for a `Reading`.

    Raises:
        RecordingNotFoundError: If the file does not exist.
        RecordingError: If it cannot be opened or read.
    """
    try:
        with Path(path).open("rb") as stream:
            yield stream
    except FileNotFoundError:
        raise RecordingNotFoundError(str(path)) from None
    except OSError as error:
        raise RecordingError(f"cannot read '{path}': {error.strerror}") from error


class TopicColumns:
    """The messages of one topic so far, in arrays that grow in place to avoid copies.

    Args:
        layout: Layout of its messages.
        names: Names of the retained fields, including times, or none; all if None.
    """

    def __init__(self, layout: MessageLayout, names: Collection[str] | None = None) -> None:
        self.layout = layout
        self.count = self.num_taken = 0
        empty = layout.unpack([])
        kept = empty if names is None else names
        self._columns = {name: empty[name].copy() for name in kept}

    @property
    def is_kept(self) -> bool:
        """Whether any field of the topic is retained."""
        return bool(self._columns)

    def append(self, block: Columns) -> None:
        """Adds messages, with one array per field."""
        count = self.count + len(block["t"])
        for name, column in self._columns.items():
            if count > len(column):
                # Resizing is safe, because nothing else refers to the array yet.
                column.resize((count + count // 4, *column.shape[1:]), refcheck=False)
            column[self.count : count] = block[name]
        self.count = count

    def take(self, count: int) -> Columns:
        """Removes and returns the first messages, with one array per field."""
        taken = {name: column[:count].copy() for name, column in self._columns.items()}
        for column in self._columns.values():
            column[: self.count - count] = column[count : self.count].copy()
        self.count -= count
        self.num_taken += count
        return taken

    def joined(self) -> Columns:
        """All messages with one array per field; no more can be added then."""
        for column in self._columns.values():
            column.resize((self.count, *column.shape[1:]), refcheck=False)
        return self._columns


class Reading:
    """One pass through one file.

    Args:
        stream: The file, opened by `open_recording`.
        name: Name of the file, for errors.
        unfinished: Whether the file may end anywhere.
        is_needed: Whether to decompress a chunk; always if None.
    """

    def __init__(
        self,
        stream: BinaryIO,
        name: str,
        *,
        unfinished: bool = False,
        is_needed: Callable[[Chunk], bool] | None = None,
    ) -> None:
        self._name = name
        self._scanner = RecordScanner(
            stream,
            name,
            self._is_wanted,
            is_ours=lambda channel: channel in self._channels,
            is_needed=is_needed,
            unfinished=unfinished,
        )
        self._unfinished = unfinished
        self._metadata: dict[str, Mapping[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._shape: TraceShape | None = None
        self._version = 0
        self._topics: dict[str, TopicColumns] = {}
        self._channels: dict[int, TopicColumns] = {}
        self._is_amount_checked = False
        self.whole_bytes = 0

    def contents(self, should_stop: Callable[[], bool] = lambda: False) -> Contents:
        """Reads the file to its end, or as far as it is valid."""
        try:
            for _ in self._records(should_stop):
                self.whole_bytes = self._scanner.offset
        except DamagedRecordingError:
            if not self._unfinished or self._shape is None:
                raise
        return self._contents({n: t.joined() for n, t in self._topics.items() if t.is_kept})

    def pieces(self, should_stop: Callable[[], bool] = lambda: False) -> Iterator[Contents]:
        """Reads a complete file in parts, each with the messages after the previous part.

        The last part also has the documents at the end of the file.
        """
        for record in self._records(should_stop):
            # The checkpoint of a chunk is its last message.
            if isinstance(record, ChannelMessages) and self._is_checkpoint(record.channel):
                yield self._contents(self._take_columns())
        yield self._contents(self._take_columns())

    def _records(
        self, should_stop: Callable[[], bool] = lambda: False
    ) -> Iterator[McapRecord | ChannelMessages]:
        records = self._scanner.records()
        self._check_header(next(records))
        for record in records:
            if should_stop():
                raise RecordingError(f"reading '{self._name}' was stopped")
            self._take(record)
            yield record

    def _is_checkpoint(self, channel: int) -> bool:
        columns = self._channels.get(channel)
        return columns is not None and columns.layout.topic.name == CHECKPOINTS.name

    def _take_columns(self) -> dict[str, Columns]:
        """The content; samples as far as all topics have them, because their order may differ."""
        counts = {name: topic.count for name, topic in self._topics.items() if topic.is_kept}
        common = min((counts[t.name] for t in SAMPLE_TOPICS if t.name in counts), default=0)
        counts |= {topic.name: common for topic in SAMPLE_TOPICS}
        return {n: topic.take(counts[n]) for n, topic in self._topics.items() if topic.is_kept}

    def _contents(self, columns: dict[str, Columns]) -> Contents:
        if self._shape is None:
            raise self._damaged("its start document is missing")
        return Contents(self._name, self._shape, self._metadata, self._attachments, columns)

    def outline(self) -> tuple[TraceShape, int]:
        """The shape of the trace and the format of the file, without decompression."""
        for _ in self._records():
            if self._shape is not None:
                return self._shape, self._version
        raise self._damaged("its start document is missing")

    def counts(self) -> tuple[TraceShape, int, dict[str, int]]:
        """The shape of the trace, the format of the file and the message counts of its topics.

        The counts are those in the index.
        """
        records = self._scanner.records()
        self._check_header(next(records))
        for record in records:
            # All channels precede the first message.
            if isinstance(record, ChannelMessages):
                break
            self._take(record)
        if self._shape is None or self._scanner.index is None:
            raise self._damaged("its start document is missing")
        stated = self._scanner.index.message_counts
        counts = {c.layout.topic.name: stated[number] for number, c in self._channels.items()}
        return self._shape, self._version, counts

    def _is_wanted(self, channel: int) -> bool:
        return channel in self._channels and self._channels[channel].is_kept

    def _take(self, record: McapRecord | ChannelMessages) -> None:
        match record:
            case ChannelMessages():
                self._take_messages(record)
            case Channel():
                self._take_channel(record)
            case Attachment():
                self._attachments[record.name] = record.data
            case Metadata():
                self._metadata[record.name] = record.metadata
                if record.name == START:
                    self._take_start(record.metadata)
            case _:
                pass

    def _check_header(self, header: object) -> None:
        if not isinstance(header, Header):
            raise self._damaged("it does not start with a header")
        if header.profile == STUDY_PROFILE:
            finding = "it is a study; 'slipgrasp rebuild' makes a recording of one of its runs"
            raise ForeignRecordingError(self._name, finding)
        if header.profile == MEASURED_PROFILE:
            raise NoRunError(self._name)
        if header.profile != PROFILE:
            finding = f"it is an MCAP file of another program ({header.library[:40]!r})"
            raise ForeignRecordingError(self._name, finding)

    def _take_start(self, start: Mapping[str, str]) -> None:
        try:
            version = int(start["format"])
            if version < 1:
                raise ValueError("there was no such format")
            if version > FORMAT_VERSION:
                raise NewerRecordingError(self._name, version, FORMAT_VERSION)
            self._shape, self._version = read_shape(start), version
        except (KeyError, TypeError, ValueError) as error:
            raise self._damaged("its start document is malformed") from error
        for topic, layout in layouts_of(self._shape, version).items():
            self._topics[topic.name] = self._columns_for(topic, layout)

    def _columns_for(self, topic: Topic, layout: MessageLayout) -> TopicColumns:
        return TopicColumns(layout)

    def _take_channel(self, channel: Channel) -> None:
        """Ignores channels of topics from other programs."""
        columns = self._topics.get(channel.topic)
        if columns is not None:
            self._channels[channel.id] = columns

    def _check_amount(self) -> None:
        """Compares stated counts with the largest possible ones for the scenario.

        This happens once, before the first message is read.
        """
        index, scenario = self._scanner.index, self._attachments.get(SCENARIO_ATTACHMENT)
        if self._is_amount_checked or index is None or scenario is None or self._shape is None:
            return
        self._is_amount_checked = True
        try:
            simulation = read_scenario(scenario).simulation
        except ValueError as error:
            raise self._damaged(f"its scenario is not valid: {error}") from error
        counts = {c.layout.topic: index.message_counts[n] for n, c in self._channels.items()}
        changes = counts.get(PHASE_CHANGES, 0)
        regular = math.ceil(simulation.duration * simulation.output_rate)
        samples = max(counts.get(topic, 0) for topic in SAMPLE_TOPICS)
        # Each event gives two samples with at most one phase change per contact.
        if samples > regular + 2 * changes + EVENTS_TO_SPARE:
            raise self._damaged(f"it states {samples} samples, more than its scenario allows")
        most = math.ceil(simulation.duration / MIN_CONTROL_PERIOD) + EVENTS_TO_SPARE
        if counts.get(TICKS, 0) > most:
            raise self._damaged(f"it states {counts[TICKS]} ticks, more than its scenario allows")
        if changes > self._shape.num_contacts * (samples + EVENTS_TO_SPARE):
            raise self._damaged(f"it states {changes} phase changes at {samples} samples")

    def _take_messages(self, messages: ChannelMessages) -> None:
        self._check_amount()
        columns = self._channels[messages.channel]
        self._check_order(messages, columns.num_taken + columns.count)
        columns.append(self._unpacked(messages, columns.layout))

    def _check_order(self, messages: ChannelMessages, first: int) -> None:
        if messages.sequences != list(range(first, first + len(messages.sequences))):
            topic = self._channels[messages.channel].layout.topic.name
            raise self._damaged(f"messages of {topic} are missing or out of order")

    def _unpacked(self, messages: ChannelMessages, layout: MessageLayout) -> Columns:
        topic = layout.topic.name
        try:
            block = layout.unpack(messages.payloads)
        except ValueError as error:
            raise self._damaged(f"{error} ({topic})") from error
        if not ((block["t"] >= 0.0) & (block["t"] <= LONGEST_RUN)).all():
            raise self._damaged(f"{topic} contains an impossible time")
        if not np.array_equal(to_log_times(block["t"]), messages.log_times):
            raise self._damaged(f"times of {topic} contradict each other")
        return block

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self._name, finding)
