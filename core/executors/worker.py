"""Main program of a worker process: tasks arrive on one pipe, results leave on another.

The main thread only reads, so that stop requests take effect during a task, and the worker exits
when its parent process ends for any reason.
"""

from __future__ import annotations

import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import BinaryIO, NamedTuple

from slipgrasp.core.executors.answers import do
from slipgrasp.core.executors.limits import OUT_OF_MEMORY, bound_memory
from slipgrasp.core.executors.messages import Kind, Message, read_message, write_message

NICENESS = 5


def serve(memory: int) -> None:
    """Executes the tasks from standard input until it is closed, then ends the process.

    Args:
        memory: Memory limit of the process [bytes].
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
    # Immediately, even during a task: nobody waits for its result.
    os._exit(0)


def _take_streams() -> tuple[BinaryIO, BinaryIO]:
    """Reserves the pipes, so that tasks read from and print to other files."""
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    sys.stdout.flush()
    os.dup2(2, 1)
    return requests, replies


class _Worker:
    """Executes tasks one after the other in a separate thread."""

    def __init__(self, requests: BinaryIO, replies: BinaryIO) -> None:
        self._requests = requests
        self._replies = replies
        self._stopped_round = 0

    def listen(self) -> None:
        """Reads messages until the pipe is closed."""
        thread = ThreadPoolExecutor(1)
        while (message := read_message(self._requests)) is not None:
            if message.kind is Kind.STOP:
                self._stopped_round = message.round
            else:
                thread.submit(self._answer, message)

    def is_to_stop(self, asked: Message) -> bool:
        """Whether a task is cancelled."""
        return self._stopped_round >= asked.round

    def tell(self, message: Message) -> None:
        """Sends a message if the parent still reads."""
        # Without a reader, the main thread ends the process.
        with suppress(OSError):
            write_message(self._replies, message)

    def _answer(self, asked: Message) -> None:
        try:
            self.tell(do(asked, _Caller(self, asked)))
        except MemoryError:
            # The remaining state is undefined.
            os._exit(OUT_OF_MEMORY)


class _Caller(NamedTuple):
    """The caller of a task, see `slipgrasp.core.executors.executor.Caller`."""

    worker: _Worker
    asked: Message

    def __call__(self) -> bool:
        return self.worker.is_to_stop(self.asked)

    def report(self, share: float) -> None:
        self.worker.tell(Message.pack(Kind.PROGRESS, self.asked.round, self.asked.number, share))
