"""Writes MCAP containers from blocks of encoded message records.

The mcap library writes single messages, which would take longer than the simulation; here a whole
chunk is written at once. All records other than messages and their index use the library. Checksums
cover every byte of the file.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

MAGIC = MCAP0_MAGIC
MESSAGE_HEAD = struct.Struct("<BQHIQQ")
"""Head of a message record: kind, length, channel, sequence, log and publish time."""

COMPRESSION_LEVEL = 1
FOOTER_HEAD = struct.Struct("<BQQQ")
FOOTER_LENGTH = 20


@dataclass(frozen=True, slots=True)
class ChannelBlock:
    """Messages of a chunk that belong to a channel: times [ns] and byte offsets."""

    channel: int
    log_times: NDArray[np.uint64]
    offsets: NDArray[np.uint64]

    def to_bytes(self) -> bytes:
        """The MCAP message index record."""
        entries = np.stack([self.log_times, self.offsets], axis=1).astype("<u8").tobytes()
        size = len(entries)
        head = struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + size, self.channel, size)
        return head + entries


class McapContainer:
    """Writes an MCAP file to a stream, from its header to its index.

    Args:
        stream: Output stream at its start.
        profile: Kind of MCAP file.
        library: Program that writes it.
    """

    def __init__(self, stream: BinaryIO, *, profile: str, library: str) -> None:
        self._stream = stream
        self._offset = 0
        self._checksum = 0
        self._schemas: list[McapRecord] = []
        self._channels: list[McapRecord] = []
        self._chunk_indexes: list[McapRecord] = []
        self._attachment_indexes: list[McapRecord] = []
        self._metadata_indexes: list[McapRecord] = []
        self._counts: dict[int, int] = {}
        self._time_range: tuple[int, int] | None = None
        self._write(MAGIC)
        self._write(_to_bytes(Header(profile=profile, library=library)))

    @property
    def message_counts(self) -> dict[int, int]:
        """Number of written messages by channel id."""
        return dict(self._counts)

    def add_topic(self, topic: str, schema: Schema, metadata: dict[str, str]) -> None:
        """Writes a schema, and a channel with the same id; its messages follow.

        Args:
            topic: Topic of the channel.
            schema: Schema of the messages.
            metadata: Metadata of the channel.
        """
        encoding = "json" if schema.encoding == "jsonschema" else schema.encoding
        channel = Channel(
            id=schema.id,
            topic=topic,
            message_encoding=encoding,
            schema_id=schema.id,
            metadata=metadata,
        )
        self._schemas.append(schema)
        self._channels.append(channel)
        self._counts[channel.id] = 0
        self._write(_to_bytes(schema))
        self._write(_to_bytes(channel))

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Writes a named document at simulation time 0."""
        attachment = Attachment(
            create_time=0, log_time=0, name=name, media_type=media_type, data=data
        )
        record = _to_bytes(attachment)
        index = AttachmentIndex(
            offset=self._offset,
            length=len(record),
            log_time=0,
            create_time=0,
            data_size=len(data),
            name=name,
            media_type=media_type,
        )
        self._attachment_indexes.append(index)
        self._write(record)

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        """Writes a named mapping of strings."""
        record = _to_bytes(Metadata(name=name, metadata=values))
        index = MetadataIndex(offset=self._offset, length=len(record), name=name)
        self._metadata_indexes.append(index)
        self._write(record)

    def add_chunk(self, messages: bytes, blocks: Sequence[ChannelBlock]) -> None:
        """Writes a chunk of message records.

        Args:
            messages: The records in order.
            blocks: Positions of the messages of each channel; none is empty.
        """
        start = int(min(block.log_times.min() for block in blocks))
        end = int(max(block.log_times.max() for block in blocks))
        compressed = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL).compress(messages)
        chunk = Chunk(
            compression="zstd",
            data=compressed,
            message_start_time=start,
            message_end_time=end,
            uncompressed_crc=zlib.crc32(messages),
            uncompressed_size=len(messages),
        )
        chunk_offset = self._offset
        self._write(_to_bytes(chunk))
        index_offset = self._offset
        index_offsets = {block.channel: self._write_index(block) for block in blocks}
        index = ChunkIndex(
            chunk_start_offset=chunk_offset,
            chunk_length=index_offset - chunk_offset,
            compression=chunk.compression,
            compressed_size=len(compressed),
            uncompressed_size=len(messages),
            message_index_offsets=index_offsets,
            message_index_length=self._offset - index_offset,
            message_start_time=start,
            message_end_time=end,
        )
        self._chunk_indexes.append(index)
        earlier = self._time_range or (start, end)
        self._time_range = (min(start, earlier[0]), max(end, earlier[1]))

    def _write_index(self, block: ChannelBlock) -> int:
        """Writes the message index of a channel in a chunk; returns its offset."""
        offset = self._offset
        self._write(block.to_bytes())
        self._counts[block.channel] += len(block.log_times)
        return offset

    def finish(self) -> None:
        """Writes the index and the end of the file; leaves the stream open."""
        self._write(_to_bytes(DataEnd(data_section_crc=self._checksum)))
        start = self._offset
        summary, offsets = self._summary(start)
        offset_start = start + len(summary)
        body = summary + offsets
        footer = Footer(
            summary_start=start,
            summary_offset_start=offset_start,
            summary_crc=summary_checksum(body, start, offset_start),
        )
        self._write(body + _to_bytes(footer) + MAGIC)

    def _summary(self, start: int) -> tuple[bytes, bytes]:
        groups = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunk_indexes),
            (Opcode.ATTACHMENT_INDEX, self._attachment_indexes),
            (Opcode.METADATA_INDEX, self._metadata_indexes),
        ]
        summary = b""
        offsets = b""
        for opcode, records in groups:
            if records:
                group = b"".join(map(_to_bytes, records))
                place = SummaryOffset(
                    group_opcode=opcode,
                    group_start=start + len(summary),
                    group_length=len(group),
                )
                offsets += _to_bytes(place)
                summary += group
        return summary, offsets

    def _statistics(self) -> Statistics:
        start, end = self._time_range or (0, 0)
        return Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunk_indexes),
            message_count=sum(self._counts.values()),
            message_start_time=start,
            message_end_time=end,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._offset += len(data)
        self._checksum = zlib.crc32(data, self._checksum)


def summary_checksum(summary: bytes, start: int, offset_start: int) -> int:
    """Checksum in the footer: of the summary and the preceding part of the footer."""
    head = FOOTER_HEAD.pack(Opcode.FOOTER, FOOTER_LENGTH, start, offset_start)
    return zlib.crc32(head, zlib.crc32(summary))


def _to_bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
