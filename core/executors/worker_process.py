"""A worker process, as seen from its parent.

It is a new interpreter that loads this package, but not the main script: scripts need no `if
__name__ == "__main__"`, and threads of the server are not copied. Its two pipes, for tasks and for
results, are open in no other process, so that the end of either process ends the reading of the
other, even within a result.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import BinaryIO, NamedTuple, cast

from slipgrasp.core.awake_clock import AwakeClock
from slipgrasp.core.executors.limits import OUT_OF_MEMORY, WorkerLimits
from slipgrasp.core.executors.messages import Kind, Message, read_message, write_message

_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from slipgrasp.core.executors.worker import serve; serve(int(sys.argv[2]))"
)
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_SIGNALS_OF_OTHERS = (9, 15)  # SIGKILL, SIGTERM
_POLL = 0.05  # [s] between two checks whether to stop
_PATIENCE = 2.0  # [s] until a process that should exit is killed


class Event(NamedTuple):
    """An event of a worker; its end if None."""

    worker: WorkerProcess
    message: Message | None


def next_event(events: SimpleQueue[Event]) -> Event | None:
    """The next event of some workers; None if there is none for a short time."""
    try:
        return events.get(timeout=_POLL)
    except Empty:
        return None


class WorkerProcess:
    """A worker process.

    Attributes:
        ready: Whether the kernel is loaded.
        asked: Request of its task; None if it is idle.
        events: Queue of its events.
    """

    def __init__(self, events: SimpleQueue[Event], limits: WorkerLimits) -> None:
        """Starts the worker without waiting for it.

        Args:
            events: Queue of its events.
            limits: Its limits.
        """
        self.ready = False
        self.asked: Message | None = None
        self.events = events
        self._limits = limits
        self._at_task = AwakeClock()
        self._overran = False
        path = json.dumps([os.path.abspath(entry) for entry in sys.path])
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, path, str(limits.memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
        )
        self._requests = cast("BinaryIO", self._process.stdin)
        self._replies = cast("BinaryIO", self._process.stdout)
        threading.Thread(target=self._listen, daemon=True).start()

    def do(self, asked: Message) -> None:
        """Assigns it a task, which is sent once it is ready."""
        self.asked = asked
        self._at_task = AwakeClock()
        if self.ready:
            self._tell(asked)

    def note_ready(self) -> None:
        """Records that it is ready, and sends it the task that it was assigned meanwhile."""
        self.ready = True
        if self.asked is not None:
            self.do(self.asked)

    def end_if_overdue(self) -> None:
        """Kills it if a task exceeds the time limit; called regularly."""
        taken = self._at_task.read()
        if self.ready and self.asked and taken > self._limits.task_seconds:
            self._overran = True
            self.kill()

    def stop(self) -> None:
        """Requests cancellation of its task, or discards a task that was not sent."""
        if self.asked is not None and self.ready:
            self._tell(Message(Kind.STOP, self.asked.round))
        else:
            self.asked = None

    def close(self) -> None:
        """Closes its pipe of tasks, so that it exits immediately."""
        with suppress(OSError):
            self._requests.close()

    def kill(self) -> None:
        """Kills the process, and closes its pipe of tasks."""
        self._process.kill()
        self.close()

    def was_killed(self) -> bool:
        """Waits for its end; returns whether SIGKILL or SIGTERM ended it."""
        return -self._wait() in _SIGNALS_OF_OTHERS

    def went_too_far(self) -> bool:
        """Waits for its end; returns whether its task exceeded a limit."""
        return self._wait() == OUT_OF_MEMORY or self._overran

    def how_it_ended(self) -> str:
        """Waits for its end; returns a description of it."""
        status = self._wait()
        if self._overran:
            return f"exceeded the time limit of {self._limits.task_seconds:g} s"
        if status == OUT_OF_MEMORY:
            return f"exceeded its memory limit of {self._limits.memory / 1e9:.3g} GB"
        if status < 0:
            return f"was killed by {signal.Signals(-status).name}"
        return f"ended with exit status {status}"

    def _wait(self) -> int:
        self.close()
        try:
            return self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def _tell(self, message: Message) -> None:
        # If it has exited or its pipe is closed, the reading thread notices.
        with suppress(OSError, ValueError):
            write_message(self._requests, message)

    def _listen(self) -> None:
        with self._replies:
            while (message := read_message(self._replies)) is not None:
                self.events.put(Event(self, message))
        self.events.put(Event(self, None))


def _environment() -> dict[str, str]:
    """One thread each, and the same cache folder of machine code."""
    from slipgrasp.core.kernel.compilation.cache import ROOT_VARIABLE, cache_root

    threads = dict.fromkeys(_THREAD_VARIABLES, "1")
    return {**os.environ, **threads, ROOT_VARIABLE: str(cache_root())}
