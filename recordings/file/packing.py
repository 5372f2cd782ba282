"""Conversion between columns of numbers and MCAP message records, in large blocks.

All messages of a topic have the same length (`slipgrasp.recordings.file.schemas`), so that a block
of samples is one numpy array of records: constant bytes (record heads, protobuf tags and lengths)
are set once per column, and numbers are copied by column.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from slipgrasp.recordings.file.schemas import Field, Topic

MESSAGE_HEAD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
"""Head of a message record in an MCAP file."""

OPCODE_AND_LENGTH_BYTES = 9

_ON_DISK = {"double": "<f8", "sint32": "u1", "fixed32": "<u4", "fixed64": "<u8"}
_VARINT, _EIGHT_BYTES, _LENGTH_DELIMITED, _FOUR_BYTES = 0, 1, 2, 5
_WIRE_TYPES = {
    "double": _EIGHT_BYTES,
    "sint32": _VARINT,
    "fixed32": _FOUR_BYTES,
    "fixed64": _EIGHT_BYTES,
}


class MessageLayout:
    """Positions of all numbers in the messages of a topic.

    Args:
        topic: Topic of the messages.
        channel: Id of the topic's channel in the file.
        widths: Number of components of each field; 1 for a single number, 0 for an empty list.
    """

    def __init__(self, topic: Topic, channel: int, widths: Sequence[int]) -> None:
        self.topic = topic
        self.channel = channel
        self._widths = dict(zip((field.name for field in topic.fields), widths, strict=True))
        self._present = [field for field in topic.fields if self._widths[field.name] > 0]
        self._tags = {f.name: self._tag(f) for f in self._present}
        self.payload_type = np.dtype([entry for f in self._present for entry in self._entries(f)])
        self.record_type = np.dtype([("head", MESSAGE_HEAD), ("payload", self.payload_type)])

    def _tag(self, field: Field) -> NDArray[np.uint8]:
        """The bytes before the value: field number with wire type, and a list's length."""
        number = self.topic.fields.index(field) + 1
        if not field.repeated:
            return _varint(number << 3 | _WIRE_TYPES[field.kind])
        length = self._widths[field.name] * np.dtype(_ON_DISK[field.kind]).itemsize
        return np.concatenate([_varint(number << 3 | _LENGTH_DELIMITED), _varint(length)])

    def _entries(self, field: Field) -> list[tuple[Any, ...]]:
        shape = (self._widths[field.name],) if field.repeated else ()
        return [
            (f"{field.name} tag", "u1", self._tags[field.name].shape),
            (field.name, _ON_DISK[field.kind], shape),
        ]

    def pack(
        self, records: NDArray[Any], columns: Mapping[str, NDArray[Any]], first_sequence: int
    ) -> None:
        """Fills message records of `record_type`.

        Args:
            records: The records, shape ``(messages,)``, changed in place.
            columns: For each field one entry or row per message; ``t`` in [s].
            first_sequence: Sequence number of the first message.
        """
        fill_heads(records, self.channel, columns["t"], first_sequence)
        payload = records["payload"]
        for field in self._present:
            payload[f"{field.name} tag"] = self._tags[field.name]
            values = columns[field.name]
            payload[field.name] = _to_zigzag(values) if field.kind == "sint32" else values

    def unpack(self, payloads: Sequence[bytes]) -> dict[str, NDArray[Any]]:
        """Reads columns from message records; the inverse of `pack`.

        Args:
            payloads: Messages without their heads.

        Returns:
            One array per field, with one entry or row per message.

        Raises:
            ValueError: If a payload does not have this layout.
        """
        if set(map(len, payloads)) - {self.payload_type.itemsize}:
            raise ValueError("a message has a wrong length for its topic")
        messages = np.frombuffer(b"".join(payloads), self.payload_type)
        if any((messages[f"{name} tag"] != tag).any() for name, tag in self._tags.items()):
            raise ValueError("a message has wrong fields for its topic")
        return {field.name: self._column(field, messages) for field in self.topic.fields}

    def _column(self, field: Field, messages: NDArray[Any]) -> NDArray[Any]:
        if field not in self._present:
            return np.empty((len(messages), 0))
        values = np.ascontiguousarray(messages[field.name])
        return _from_zigzag(values) if field.kind == "sint32" else values


def fill_heads(
    records: NDArray[Any], channel: int, times: NDArray[np.float64], first_sequence: int
) -> None:
    """Fills the heads of message records.

    Args:
        records: The records, shape ``(messages,)``, with a field ``head``; changed in place.
        channel: Id of their channel.
        times: Their times [s].
        first_sequence: Sequence number of the first message.
    """
    head = records["head"]
    head["opcode"] = Opcode.MESSAGE
    head["length"] = records.dtype.itemsize - OPCODE_AND_LENGTH_BYTES
    head["channel"] = channel
    head["sequence"] = first_sequence + np.arange(len(records))
    head["log_time"] = head["publish_time"] = to_log_times(times)


def to_log_times(times: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Converts simulation times [s] to integer nanoseconds, as in MCAP."""
    return np.rint(times * 1e9).astype(np.uint64)


def _varint(value: int) -> NDArray[np.uint8]:
    """A number in protobuf's variable length: seven bits per byte, least significant first."""
    groups = []
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    return np.array([*groups, value], dtype=np.uint8)


def _to_zigzag(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Signed numbers -64 … 63 as protobuf writes a sint32: 0, -1, 1, -2, … in one byte."""
    wide = values.astype(np.int16)
    return ((wide << 1) ^ (wide >> 15)).astype(np.uint8)


def _from_zigzag(values: NDArray[np.uint8]) -> NDArray[np.int8]:
    wide = values.astype(np.int16)
    return ((wide >> 1) ^ -(wide & 1)).astype(np.int8)
