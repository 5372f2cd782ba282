"""Protobuf messages of equal length, created in blocks from one example.

protobuf creates single messages, which would take longer than the simulation. All messages of a
display topic are equal except for some numbers, so that the library encodes one example in which
each of these numbers is a unique placeholder. numpy then copies the example and replaces the
placeholders.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import NDArray

from slipgrasp.recordings.file.packing import to_log_times
from slipgrasp.scene.states import States

Column = Callable[[States], NDArray[np.float64]]
"""A function from states to one number per state."""

_NUMBER = struct.Struct("<d")
_PLACEHOLDER = struct.Struct("<II")
_PLACEHOLDER_END = 0x5A5AC0DE
"""A number around 1e127, which is no length, colour or angle."""
_PLACEHOLDER_MARK = _PLACEHOLDER_END.to_bytes(4, "little")
_ANY_PLACEHOLDER = re.compile(b"(....)" + re.escape(_PLACEHOLDER_MARK), re.DOTALL)

_SECONDS_BYTES, _NANOSECONDS_BYTES = 2, 5
_ALWAYS = Timestamp(seconds=(1 << 14) - 1, nanos=(1 << 31) - 1)
"""Placeholder of all times: the largest numbers of 2 and 5 bytes that its fields allow."""


def once(column: Column) -> Column:
    """A column with several components, evaluated once for the same states."""
    seen: States | None = None
    found = np.empty(0)

    def evaluate(states: States) -> NDArray[np.float64]:
        nonlocal seen, found
        if states is not seen:
            seen, found = states, column(states)
        return found

    return evaluate


class Blanks:
    """Creates placeholders for an example, and stores their columns."""

    def __init__(self) -> None:
        self.columns: list[tuple[Column, int]] = []
        self.count = 0

    def number(self, column: Column) -> float:
        """A placeholder for the numbers ``(n,)`` of a column, to be used exactly once."""
        return self.numbers(lambda states: column(states)[:, None], 1)[0]

    def numbers(self, columns: Column, count: int) -> list[float]:
        """Placeholders for all columns of an array ``(n, count)``, each to be used exactly once."""
        self.columns.append((columns, count))
        first, self.count = self.count, self.count + count
        marks = (_PLACEHOLDER.pack(i, _PLACEHOLDER_END) for i in range(first, self.count))
        return [number for mark in marks for number in _NUMBER.unpack(mark)]

    def vector(self, value: tuple[float, ...] | Column) -> Vector3:
        """A vector, with placeholders if it moves."""
        x, y, z = self.numbers(value, 3) if callable(value) else value
        return Vector3(x=x, y=y, z=z)

    def quaternion(self, value: tuple[float, ...] | Column) -> Quaternion:
        """A quaternion (w, x, y, z), with placeholders if it moves."""
        w, x, y, z = self.numbers(value, 4) if callable(value) else value
        return Quaternion(w=w, x=x, y=y, z=z)

    def time(self) -> Timestamp:
        """A placeholder for the time of a sample, to be used any number of times."""
        return _ALWAYS


class Template:
    """A template for messages that differ only in the values of placeholders.

    Args:
        example: The message with placeholders.
        blanks: The placeholders.
    """

    def __init__(self, example: Message, blanks: Blanks) -> None:
        payload = example.SerializeToString(deterministic=True)
        self._example = np.frombuffer(payload, np.uint8)
        self._columns = blanks.columns
        self._numbers = np.dtype(
            {
                "names": [str(i) for i in range(blanks.count)],
                "formats": ["<f8"] * blanks.count,
                "offsets": _places_of_numbers(payload, blanks.count),
                "itemsize": len(payload),
            }
        )
        self._times = _places_of_times(payload)

    @property
    def size(self) -> int:
        """Size of a message [bytes]."""
        return len(self._example)

    def fill(self, payloads: NDArray[np.uint8], states: States) -> None:
        """Writes one message per state.

        Args:
            payloads: Output, shape ``(states, size)``, changed in place.
            states: States to show.
        """
        payloads[...] = self._example
        numbers: NDArray[Any] = payloads.view(self._numbers)[:, 0]
        names = iter(self._numbers.names or ())
        for columns, count in self._columns:
            for name, column in zip(islice(names, count), columns(states).T, strict=True):
                numbers[name] = column
        times = _to_timestamps(states.times)
        for place in self._times:
            payloads[:, place : place + times.shape[1]] = times


def _places_of_numbers(payload: bytes, count: int) -> list[int]:
    found = {int.from_bytes(m[1], "little"): m.start() for m in _ANY_PLACEHOLDER.finditer(payload)}
    assert payload.count(_PLACEHOLDER_MARK) == count, "a placeholder is used exactly once"
    return [found[index] for index in range(count)]


def _places_of_times(payload: bytes) -> list[int]:
    mark = _ALWAYS.SerializeToString()
    places = [payload.find(mark)]
    while places[-1] >= 0:
        places.append(payload.find(mark, places[-1] + len(mark)))
    return places[:-1]


def _to_timestamps(times: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The fields of a protobuf timestamp, tags included, shape ``(times, bytes)``.

    Small numbers are padded with zeros, so that all timestamps have the same length; every decoder
    accepts that.
    """
    seconds, nanoseconds = np.divmod(to_log_times(times), np.uint64(10**9))
    second_tag, nanosecond_tag = (
        np.full((len(times), 1), field << 3, np.uint8)
        for field in (Timestamp.SECONDS_FIELD_NUMBER, Timestamp.NANOS_FIELD_NUMBER)
    )
    parts = [
        second_tag,
        _to_varints(seconds, _SECONDS_BYTES),
        nanosecond_tag,
        _to_varints(nanoseconds, _NANOSECONDS_BYTES),
    ]
    return np.concatenate(parts, axis=1)


def _to_varints(values: NDArray[np.uint64], length: int) -> NDArray[np.uint8]:
    """Numbers in protobuf's variable length, padded to ``length`` bytes."""
    shifts = np.arange(0, 7 * length, 7, dtype=np.uint64)
    groups = (values[:, None] >> shifts & np.uint64(0x7F)).astype(np.uint8)
    groups[:, :-1] |= 0x80
    return groups
