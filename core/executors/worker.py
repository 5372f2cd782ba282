"""What runs inside a worker process: tasks come in on one pipe, results go out on another.

The main thread only listens, so that a wish to stop is heard while a task is done, and so
that the worker ends as soon as the process that started it is gone, however that came about.
"""

from __future__ import annotations

import os
import signal
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import BinaryIO, NamedTuple

from slipgrasp.core.executors.answers import do, reply_with
from slipgrasp.core.executors.limits import OUT_OF_MEMORY, bound_memory
from slipgrasp.core.executors.messages import Kind, Message, read_message, write_message

NICENESS = 5


def serve(memory: int) -> None:
    """Does the tasks that come in on standard input until it is closed, and ends the process.

    Args:
        memory: How much the process may use [bytes].
    """
    bound_memory(memory)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    requests, replies = _take_streams()
    from slipgrasp.core.run.simulator import prepare_kernel

    prepare_kernel()
    with suppress(OSError):
        write_message(replies, Message(Kind.READY))
        _Worker(requests, replies).listen()
    # At once, whatever a task is at: nobody waits for it any more.
    os._exit(0)


def _take_streams() -> tuple[BinaryIO, BinaryIO]:
    """Keeps the pipes to ourselves: what a task reads and prints goes elsewhere."""
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    sys.stdout.flush()
    os.dup2(2, 1)
    return requests, replies


class _Worker:
    """Does one task after the other, in a thread of its own."""

    def __init__(self, requests: BinaryIO, replies: BinaryIO) -> None:
        self._requests = requests
        self._replies = replies
        self._stopped_round = 0

    def listen(self) -> None:
        """Takes what comes in until there is nothing to come."""
        thread = ThreadPoolExecutor(1)
        while (message := read_message(self._requests)) is not None:
            if message.kind is Kind.STOP:
                self._stopped_round = message.round
            else:
                done = thread.submit(do, message, _Caller(self, message))
                done.add_done_callback(partial(self._answer, message))

    def is_to_stop(self, asked: Message) -> bool:
        """Whether a task is wanted no more."""
        return self._stopped_round >= asked.round

    def tell(self, message: Message) -> None:
        """Sends a message, if anybody reads it still."""
        # Without a reader the listening thread ends the process.
        with suppress(OSError):
            write_message(self._replies, message)

    def _answer(self, asked: Message, done: Future[Message]) -> None:
        if isinstance(done.exception(), MemoryError):
            # What is left of it may be in any state.
            os._exit(OUT_OF_MEMORY)
        self.tell(reply_with(asked, done))


class _Caller(NamedTuple):
    """The caller of a task, see `slipgrasp.core.executors.executor.Caller`."""

    worker: _Worker
    asked: Message

    def __call__(self) -> bool:
        return self.worker.is_to_stop(self.asked)

    def report(self, share: float) -> None:
        self.worker.tell(Message.pack(Kind.PROGRESS, self.asked.round, self.asked.number, share))
