"""Reads an untrusted MCAP file record by record.

Sizes are checked before anything is read or decompressed, every checksum is compared, and the
statements at the end of the file must agree with its content. All counts are limited, so that a
small file cannot take long to read.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import BinaryIO, TypeVar

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    Schema,
    Statistics,
)
from numpy.typing import NDArray

from slipgrasp.recordings.exceptions import DamagedRecordingError, ForeignRecordingError
from slipgrasp.recordings.file.container import FOOTER_LENGTH, MAGIC, summary_checksum
from slipgrasp.recordings.file.packing import MESSAGE_HEAD, OPCODE_AND_LENGTH_BYTES

MAX_CHUNK_BYTES = 1 << 23
MAX_RECORD_BYTES = 1 << 20
MAX_SUMMARY_BYTES = 1 << 25
MAX_RECORDS_PER_KIND = 256
MAX_UNWANTED_MESSAGES = 250_000
MAX_UNPACKED_PER_BYTE = 16
UNPACKED_TO_SPARE = 1 << 24
"""Compression ratio limit; chunks of a hand at rest reach six, and small files have no limit."""


_RECORD_HEAD = struct.Struct("<BQ")
_SIZE = struct.Struct("<Q")
_FOOTER_HEAD = _RECORD_HEAD.pack(Opcode.FOOTER, FOOTER_LENGTH)
_TAIL_BYTES = _RECORD_HEAD.size + FOOTER_LENGTH + len(MAGIC)

_KIND_BYTES = OPCODE_AND_LENGTH_BYTES + 2
"""Length and channel in the head of a message."""

_LONGEST_ROW = 64

Record = TypeVar(
    "Record",
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    Metadata,
    Schema,
    Statistics,
)


@dataclass(slots=True)
class ChannelMessages:
    """The messages of one channel in one chunk, in the order of the file."""

    channel: int
    sequences: list[int] = field(default_factory=list)
    log_times: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class StatedIndex:
    """Statements at the end of a file about its content.

    Attributes:
        start: Start of the index.
        message_counts: Number of messages by channel.
        num_attachments: Number of attachments.
        unpacked_bytes: Decompressed size of all chunks; None if it is not stated.
    """

    start: int
    message_counts: Counter[int]
    num_attachments: int
    unpacked_bytes: int | None


class RecordScanner:
    """Reads the records of a file in one pass.

    Args:
        stream: The file, opened for binary reading.
        name: Name of the file, for errors.
        is_wanted: Whether to return the messages of a channel; all others are counted.
        is_ours: Whether this program wrote the messages of a channel; if None, those that
            ``is_wanted`` selects.
        is_needed: Whether to decompress a chunk; always if None.
        unfinished: Whether the file may be incomplete; its end then counts as damage.
        max_record_bytes: Largest size of a record other than a chunk.

    Attributes:
        index: Stated content, known before the first record; None if unfinished.
        offset: Number of bytes read so far.
    """

    def __init__(
        self,
        stream: BinaryIO,
        name: str,
        is_wanted: Callable[[int], bool],
        *,
        is_ours: Callable[[int], bool] | None = None,
        is_needed: Callable[[Chunk], bool] | None = None,
        unfinished: bool = False,
        max_record_bytes: int = MAX_RECORD_BYTES,
    ) -> None:
        self._stream = stream
        self._name = name
        self._is_wanted = is_wanted
        self._is_ours = is_ours or is_wanted
        self._is_needed = is_needed
        self._tail = 0 if unfinished else _TAIL_BYTES
        self._max_record_bytes = max_record_bytes
        self._size = os.fstat(stream.fileno()).st_size
        self.offset = 0
        self._checksum = 0
        self._counts: Counter[type] = Counter()
        self._message_counts: Counter[int] = Counter()
        self._num_wanted = 0
        self._num_unwanted = 0
        self._has_skipped = False
        self._indexes_left = 0
        self._unpacked_left = MAX_UNPACKED_PER_BYTE * self._size + UNPACKED_TO_SPARE
        self.index: StatedIndex | None = None

    def records(self) -> Iterator[McapRecord | ChannelMessages]:
        """Yields header, schemas, channels, attachments, metadata and blocks of messages.

        Raises:
            ForeignRecordingError: If it is not an MCAP file.
            DamagedRecordingError: If it is incomplete or changed.
        """
        self._check_both_ends()
        while True:
            checksum = self._checksum
            opcode, body = self._next_record()
            match opcode:
                case Opcode.HEADER:
                    yield self._parse(Header, body)
                case Opcode.SCHEMA:
                    yield self._parse(Schema, body)
                case Opcode.CHANNEL:
                    yield self._parse(Channel, body)
                case Opcode.ATTACHMENT:
                    yield self._parse(Attachment, body)
                case Opcode.METADATA:
                    yield self._parse(Metadata, body)
                case Opcode.CHUNK:
                    yield from self._take_chunk(self._parse(Chunk, body))
                case Opcode.MESSAGE_INDEX if self._indexes_left > 0:
                    self._indexes_left -= 1
                case Opcode.DATA_END:
                    self._check_ending(self._parse(DataEnd, body), checksum)
                    return
                case _:
                    raise self._damaged(f"it contains a record of unexpected kind {opcode}")

    def _check_both_ends(self) -> None:
        if self._size == 0:
            raise self._damaged("it is empty")
        start = self._read(min(len(MAGIC), self._size))
        if start != MAGIC[: len(start)]:
            is_table = self._name.lower().endswith(".csv")
            way_out = "; 'slipgrasp import' makes a recording of a table" * is_table
            raise ForeignRecordingError(self._name, f"it is not an MCAP file{way_out}")
        if self._tail == 0:
            return
        self._stream.seek(-min(len(MAGIC), self._size), os.SEEK_END)
        if self._size < len(MAGIC) + _TAIL_BYTES or self._stream.read() != MAGIC:
            finding = "its end is missing; 'slipgrasp recover' recovers its content"
            raise self._damaged(finding)
        self.index = self._read_index()
        self._check_unpacked(self.index.unpacked_bytes or 0)
        self._stream.seek(self.offset)

    def _read_index(self) -> StatedIndex:
        """Reads the index first, so that excessive claims are rejected before decompression."""
        self._stream.seek(self._size - _TAIL_BYTES)
        tail = self._stream.read(_TAIL_BYTES)
        if not tail.startswith(_FOOTER_HEAD):
            raise self._damaged("its footer is malformed")
        footer = self._parse(Footer, tail[_RECORD_HEAD.size : -len(MAGIC)])
        length = self._size - _TAIL_BYTES - footer.summary_start
        if footer.summary_start < len(MAGIC) or length < 0:
            raise self._damaged("the checksum of its index does not match")
        if length > MAX_SUMMARY_BYTES:
            raise self._damaged("its index is too large")
        self._stream.seek(footer.summary_start)
        summary = self._stream.read(length)
        expected = summary_checksum(summary, footer.summary_start, footer.summary_offset_start)
        if footer.summary_crc not in (0, expected):
            raise self._damaged("the checksum of its index does not match")
        return self._parse_index(footer.summary_start, summary)

    def _parse_index(self, start: int, summary: bytes) -> StatedIndex:
        statistics: Statistics | None = None
        sizes: list[int] = []
        offset = 0
        while offset + _RECORD_HEAD.size <= len(summary):
            opcode, length = _RECORD_HEAD.unpack_from(summary, offset)
            offset += _RECORD_HEAD.size
            body = summary[offset : offset + length]
            if opcode == Opcode.STATISTICS:
                statistics = self._parse(Statistics, body)
            elif opcode == Opcode.CHUNK_INDEX and length >= _SIZE.size:
                # The last number of the record.
                sizes += _SIZE.unpack_from(body, len(body) - _SIZE.size)
            offset += length
        if statistics is None:
            raise self._damaged("its index has no statistics")
        counts = Counter(statistics.channel_message_counts)
        return StatedIndex(start, counts, statistics.attachment_count, sum(sizes) or None)

    def _check_unpacked(self, size: int) -> None:
        if size > self._unpacked_left:
            raise self._damaged(
                f"{self._size} bytes claim to contain more than {size} decompressed ones"
            )

    def _next_record(self) -> tuple[int, bytes]:
        if self._size - self.offset < _RECORD_HEAD.size + self._tail:
            raise self._damaged("its data end too early")
        opcode, length = _RECORD_HEAD.unpack(self._read(_RECORD_HEAD.size))
        limit = 2 * MAX_CHUNK_BYTES if opcode == Opcode.CHUNK else self._max_record_bytes
        if length > min(limit, self._size - self.offset - self._tail):
            raise self._damaged(f"a record claims to be {length} bytes long")
        return opcode, self._read(length)

    def _read(self, length: int) -> bytes:
        data = self._stream.read(length)
        if len(data) != length:
            raise self._damaged("it became shorter while it was read")
        self.offset += length
        self._checksum = zlib.crc32(data, self._checksum)
        return data

    def _parse(self, kind: type[Record], body: bytes) -> Record:
        self._counts[kind] += 1
        if self._counts[kind] > MAX_RECORDS_PER_KIND and kind is not Chunk:
            raise self._damaged(
                f"it contains more {kind.__name__.lower()} records than any recording"
            )
        try:
            return kind.read(ReadDataStream(BytesIO(body)))
        except (McapError, OverflowError, struct.error, ValueError) as error:
            raise self._damaged(f"a {kind.__name__.lower()} record is malformed") from error

    def _take_chunk(self, chunk: Chunk) -> Iterator[McapRecord | ChannelMessages]:
        self._indexes_left = MAX_RECORDS_PER_KIND
        if self._is_needed is None or self._is_needed(chunk):
            yield from self._unpack_chunk(chunk)
        else:
            self._has_skipped = True

    def _unpack_chunk(self, chunk: Chunk) -> Iterator[McapRecord | ChannelMessages]:
        data = self._decompress(chunk)
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise self._damaged("the checksum of a chunk does not match")
        before = self._message_counts.total()
        blocks: dict[int, ChannelMessages] = {}
        offset = 0
        while offset + _RECORD_HEAD.size <= len(data):
            opcode, length = _RECORD_HEAD.unpack_from(data, offset)
            body = offset + _RECORD_HEAD.size
            end = body + length
            if end > len(data):
                break
            if opcode == Opcode.MESSAGE and end >= offset + MESSAGE_HEAD.itemsize:
                end = self._take_messages(data, offset, blocks)
            elif opcode == Opcode.SCHEMA:
                yield self._parse(Schema, data[body:end])
            elif opcode == Opcode.CHANNEL:
                yield self._parse(Channel, data[body:end])
            else:
                break
            offset = end
        if offset != len(data) or self._message_counts.total() == before:
            raise self._damaged("a chunk ends within a message")
        yield from blocks.values()

    def _take_messages(self, data: bytes, start: int, blocks: dict[int, ChannelMessages]) -> int:
        """Reads a table of similar messages; returns its end."""
        lengths = _row_at(data, start)
        period = sum(lengths)
        rows = _rows_alike(data, start, lengths)
        for length in lengths:
            records = rows[:, :length]
            rows = rows[:, length:]
            self._take_block(records, blocks)
        return start + len(rows) * period

    def _take_block(self, records: NDArray[np.uint8], blocks: dict[int, ChannelMessages]) -> None:
        """Accepts messages of one channel and length, ``(messages, bytes)``."""
        heads = np.ascontiguousarray(records[:, : MESSAGE_HEAD.itemsize]).view(MESSAGE_HEAD)[:, 0]
        channel, count = int(heads["channel"][0]), len(records)
        self._message_counts[channel] += count
        if self.index and self._message_counts[channel] > self.index.message_counts[channel]:
            raise self._damaged("its number of messages differs from its index")
        if not self._is_ours(channel):
            self._num_unwanted += count
            # A recording shows each sample in at most two display topics.
            if self._num_unwanted > MAX_UNWANTED_MESSAGES + self._num_wanted:
                raise self._damaged("it contains too many messages of other programs")
            return
        self._num_wanted += count
        if not self._is_wanted(channel):
            return
        block = blocks.get(channel)
        if block is None:
            block = blocks[channel] = ChannelMessages(channel)
        block.sequences += heads["sequence"].tolist()
        block.log_times += heads["log_time"].tolist()
        payloads = records[:, MESSAGE_HEAD.itemsize :].tobytes()
        size = records.shape[1] - MESSAGE_HEAD.itemsize
        block.payloads += [payloads[i * size : (i + 1) * size] for i in range(count)]

    def _decompress(self, chunk: Chunk) -> bytes:
        size = chunk.uncompressed_size
        if size > MAX_CHUNK_BYTES:
            raise self._damaged(f"a chunk claims {size} bytes, more than {MAX_CHUNK_BYTES}")
        self._check_unpacked(size)
        self._unpacked_left -= size
        if chunk.compression == "":
            return chunk.data
        if chunk.compression != "zstd":
            raise self._damaged(f"its compression {chunk.compression[:20]!r} is not known")
        decompressor = zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES)
        try:
            data = decompressor.stream_reader(chunk.data).read(size + 1)
        except zstandard.ZstdError as error:
            raise self._damaged("a chunk cannot be decompressed") from error
        if len(data) != size:
            raise self._damaged("the size of a chunk differs from its claim")
        return data

    def _check_ending(self, data_end: DataEnd, checksum: int) -> None:
        """Compares checksums (0 means none), and the index with the content."""
        if data_end.data_section_crc not in (0, checksum):
            raise self._damaged("the checksum of its data does not match")
        if self.index is None:
            return
        if self.index.start != self.offset:
            raise self._damaged("the checksum of its index does not match")
        has_all = self._has_skipped or self._message_counts == self.index.message_counts
        if not has_all or self._counts[Attachment] != self.index.num_attachments:
            raise self._damaged("its number of messages differs from its index")

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self._name, finding)


def _row_at(data: bytes, start: int) -> list[int]:
    """Lengths of the message records until a channel repeats: one row."""
    lengths: list[int] = []
    channels: set[bytes] = set()
    while len(lengths) < _LONGEST_ROW and start + MESSAGE_HEAD.itemsize <= len(data):
        opcode, length = _RECORD_HEAD.unpack_from(data, start)
        end = start + _RECORD_HEAD.size + length
        channel = data[start + OPCODE_AND_LENGTH_BYTES : start + _KIND_BYTES]
        is_message = opcode == Opcode.MESSAGE and end >= start + MESSAGE_HEAD.itemsize
        if not is_message or end > len(data) or channel in channels:
            break
        channels.add(channel)
        lengths.append(end - start)
        start = end
    return lengths


def _rows_alike(data: bytes, start: int, lengths: list[int]) -> NDArray[np.uint8]:
    """All following rows whose messages have the same lengths and first channels.

    The messages of a sample are adjacent, so that most of a chunk is one such table; reading single
    messages takes ten times as long.
    """
    period = sum(lengths)
    starts = np.cumsum([0, *lengths[:-1]])
    kinds = (starts[:, None] + np.arange(_KIND_BYTES)).ravel()
    count = (len(data) - start) // period
    table = np.frombuffer(data, np.uint8, count * period, start).reshape(count, period)
    alike, step = 1, 1
    # The look-ahead grows with the table, to avoid quadratic cost if rows change often.
    while alike < count:
        other = np.flatnonzero((table[alike : alike + step, kinds] != table[0, kinds]).any(axis=1))
        if len(other):
            return table[: alike + other[0]]
        alike, step = min(alike + step, count), 2 * step
    return table
