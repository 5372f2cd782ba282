"""Messages between a process and its workers, over pipes.

The content of a task stays pickled until it is used, so that a task that cannot be unpickled
affects no other.
"""

from __future__ import annotations

import pickle
from enum import IntEnum
from typing import BinaryIO, NamedTuple, cast


class Kind(IntEnum):
    """Kind of message."""

    DO = 1  # to the worker: a function and its task
    STOP = 2  # to the worker: cancel all tasks up to this round
    READY = 3  # from the worker: the kernel is loaded
    RESULT = 4  # from the worker: the result of the function
    ERROR = 5  # from the worker: the exception of the function, with its origin
    CANCELLED = 6  # from the worker: cancelled on request
    PROGRESS = 7  # from the worker: completed fraction of the task


class Message(NamedTuple):
    """A message.

    Attributes:
        kind: Kind of message.
        round: Number of its `map` call.
        number: Number of its task.
        body: Packed objects.
    """

    kind: Kind
    round: int = 0
    number: int = 0
    body: bytes = b""

    @classmethod
    def pack(cls, kind: Kind, round: int, number: int, content: object) -> Message:
        """Returns a message with this content."""
        return cls(kind, round, number, pickle.dumps(content, pickle.HIGHEST_PROTOCOL))

    def unpack(self) -> object:
        """Returns the content, which comes from a worker or its parent."""
        return pickle.loads(self.body)


def write_message(stream: BinaryIO, message: Message) -> None:
    """Writes a message immediately.

    Raises:
        OSError: If the other end is closed.
    """
    stream.write(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))
    stream.flush()


def read_message(stream: BinaryIO) -> Message | None:
    """Reads the next message; None if the other end is closed, even within a message."""
    try:
        return cast("Message", pickle.load(stream))
    except (EOFError, pickle.UnpicklingError):
        return None
