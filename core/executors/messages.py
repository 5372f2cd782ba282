"""What goes between a process and its workers, over pipes.

A message stands behind its length. What a task holds stays packed until it is where it is
needed, so that a task that cannot be unpacked spoils no other.
"""

from __future__ import annotations

import pickle
import struct
from enum import IntEnum
from typing import BinaryIO, NamedTuple

_HEAD = struct.Struct("<BqqQ")


class Kind(IntEnum):
    """What a message says."""

    DO = 1  # to the worker: a function and its task
    STOP = 2  # to the worker: give up all tasks up to this round
    READY = 3  # from the worker: the kernel is loaded
    RESULT = 4  # from the worker: what the function gave
    ERROR = 5  # from the worker: what the function raised, and where
    CANCELLED = 6  # from the worker: given up as asked
    PROGRESS = 7  # from the worker: the share of the task that is done


class Message(NamedTuple):
    """A message.

    Attributes:
        kind: What it says.
        round: Which `map` it belongs to.
        number: Which task of it.
        body: Packed objects.
    """

    kind: Kind
    round: int = 0
    number: int = 0
    body: bytes = b""

    @classmethod
    def pack(cls, kind: Kind, round: int, number: int, content: object) -> Message:
        """A message with this content."""
        return cls(kind, round, number, pickle.dumps(content, pickle.HIGHEST_PROTOCOL))

    def unpack(self) -> object:
        """The content; it comes from one of our workers or from its parent."""
        return pickle.loads(self.body)


def write_message(stream: BinaryIO, message: Message) -> None:
    """Writes a message at once.

    Raises:
        OSError: If nobody reads any more.
    """
    head = _HEAD.pack(message.kind, message.round, message.number, len(message.body))
    stream.write(head + message.body)
    stream.flush()


def read_message(stream: BinaryIO) -> Message | None:
    """The next message; None if the other end is gone, in the middle of a message too."""
    head = stream.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    kind, round, number, size = _HEAD.unpack(head)
    body = stream.read(size)
    return Message(Kind(kind), round, number, body) if len(body) == size else None
