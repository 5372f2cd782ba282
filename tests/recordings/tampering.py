"""Two ways to alter a recording by one bit so that every checksum fits again."""

import struct
import zlib

import zstandard
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

CHUNK, DATA_END, CHANNEL, MESSAGE = 0x06, 0x0F, 0x04, 0x05
MAGIC_BYTES = 8
HEAD = struct.Struct("<BQ")
LAST_NUMBER = 8


def repack(source, target, topic, number):
    """Copies a recording with the mcap library, one bit of one message flipped or none.

    Args:
        source: The recording.
        target: The copy.
        topic: Topic of the message.
        number: Which message of the topic; its last number changes in its last bit. None
            leaves all as they are.
    """
    with source.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    (channel,) = (c.id for c in summary.channels.values() if c.topic == topic)
    with source.open("rb") as old, target.open("wb") as new:
        writer = Writer(new, enable_data_crcs=True)
        writer.start(profile="slipgrasp", library="a tool to tamper with")
        for record in StreamReader(old).records:
            copy_record(writer, record, (channel, number))
        writer.finish()


def copy_record(writer, record, altered):
    match record:
        case Schema():
            writer.register_schema(record.name, record.encoding, record.data)
        case Channel():
            kind = record.topic, record.message_encoding, record.schema_id
            writer.register_channel(*kind, record.metadata)
        case Attachment():
            kind = record.create_time, record.log_time, record.name, record.media_type
            writer.add_attachment(*kind, record.data)
        case Metadata():
            writer.add_metadata(record.name, record.metadata)
        case Message():
            data = bytearray(record.data)
            data[-LAST_NUMBER] ^= (record.channel_id, record.sequence) == altered
            times = record.log_time, bytes(data), record.publish_time, record.sequence
            writer.add_message(record.channel_id, *times)


def patch_in_place(source, target, topic):
    """Flips one bit of one message where it lies; the file keeps its length.

    Args:
        source: The recording.
        target: Where the altered file goes.
        topic: Topic of the message.

    Returns:
        Which message of the topic was altered; its last number changes in its last bit.
    """
    data = bytearray(source.read_bytes())
    records = list(records_of(data, MAGIC_BYTES))
    end = next(start for opcode, start, _ in records if opcode == DATA_END)
    for opcode, start, length in records:
        if opcode == CHUNK and (number := patch_chunk(data, start, length, topic)) is not None:
            data_crc = zlib.crc32(data[: end - HEAD.size])
            struct.pack_into("<I", data, end, data_crc)
            target.write_bytes(data)
            return number
    raise AssertionError("no chunk keeps its compressed length")


def records_of(data, start):
    """Opcode, start and length of the contents of each record."""
    while start + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, start)
        yield opcode, start + HEAD.size, length
        start += HEAD.size + length


def patch_chunk(data, start, length, topic):
    """Alters the first message of a chunk that can be without changing its compressed length."""
    (name_length,) = struct.unpack_from("<I", data, start + 28)
    body = start + 32 + name_length + 8
    content = zstandard.ZstdDecompressor().decompress(bytes(data[body : start + length]))
    channels = {
        struct.unpack_from("<H", content, at)[0]
        for opcode, at, size in records_of(content, 0)
        if opcode == CHANNEL and topic.encode() in content[at : at + size]
    } or channels_of(data, topic)
    for opcode, at, size in records_of(content, 0):
        channel, sequence = struct.unpack_from("<HI", content, at)
        if opcode != MESSAGE or channel not in channels:
            continue
        altered = bytearray(content)
        altered[at + size - LAST_NUMBER] ^= 1
        packed = zstandard.ZstdCompressor(level=1).compress(bytes(altered))
        if len(packed) == start + length - body:
            struct.pack_into("<I", data, start + 24, zlib.crc32(altered))
            data[body : start + length] = packed
            return sequence
    return None


def channels_of(data, topic):
    """Ids of the channels of a topic that stand outside of chunks."""
    return {
        struct.unpack_from("<H", data, at)[0]
        for opcode, at, size in records_of(data, MAGIC_BYTES)
        if opcode == CHANNEL and topic.encode() in data[at : at + size]
    }
