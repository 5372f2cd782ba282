"""Single tasks for waiting callers, in worker processes that are reused.

For tasks that may crash their process. `slipgrasp.core.executors.processes` is for many independent
tasks that may be attempted again; these are attempted once.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from queue import Empty, LifoQueue, SimpleQueue
from typing import TypeVar, cast

from slipgrasp.core.executors.answers import ask, open_answer
from slipgrasp.core.executors.executor import (
    Caller,
    Cancelled,
    ExecutorError,
    ShouldStop,
    TaskFunction,
)
from slipgrasp.core.executors.limits import WorkerLimits
from slipgrasp.core.executors.messages import Kind, Message
from slipgrasp.core.executors.worker_process import WorkerProcess, next_event

Task = TypeVar("Task")
Result = TypeVar("Result")

_GIVING_UP = 1.0  # [s] until a worker that does not finish is killed
_TOO_LATE = f"did not finish within {_GIVING_UP:g} s of the request"


class WorkerDiedError(ExecutorError):
    """A worker died before its task finished; the message says how."""


class SingleTasks:
    """Executes single tasks for waiting callers, in as many processes as there are callers.

    Thread-safe. Processes start on first use.
    """

    def __init__(self, limits: WorkerLimits) -> None:
        """Creates the executor without starting anything.

        Args:
            limits: Limits of each task.
        """
        self._limits = limits
        self._idle: LifoQueue[WorkerProcess] = LifoQueue()
        self._rounds = count(1)
        self._closed = threading.Event()

    def do(
        self,
        function: Callable[[Task, Caller], Result],
        task: Task,
        should_stop: ShouldStop,
        progress: Callable[[float], None] = lambda share: None,
    ) -> Result:
        """Executes a task.

        Args:
            function: A function of an imported module. Its second argument returns whether to stop;
                it still returns its result then. It may report the progress of the task.
            task: Argument of the function.
            should_stop: Called about 20 times a second; True requests the function to stop. Its
                worker is killed a second later.
            progress: Called with the completed fraction, 0 to 1, that the function reports.

        Raises:
            Cancelled: If it was stopped before it started.
            WorkerDiedError: If its worker dies.
            Exception: Any exception of the function.
        """
        process = self._take_process()
        asked = ask(next(self._rounds), 0, cast("TaskFunction[Task, Result]", function), task)
        process.do(asked)
        answer = _answer_of(process, lambda: self._closed.is_set() or should_stop(), progress)
        self._idle.put(process)
        if self._closed.is_set():
            self.close()
        if answer.kind is Kind.CANCELLED:
            raise Cancelled
        return cast("Result", open_answer(answer))

    def close(self) -> None:
        """Stops the workers; running tasks are requested to stop."""
        self._closed.set()
        with suppress(Empty):
            while True:
                self._idle.get_nowait().how_it_ended()

    def _take_process(self) -> WorkerProcess:
        with suppress(Empty):
            while not (process := self._idle.get_nowait()).events.empty():
                process.how_it_ended()
            return process
        return WorkerProcess(SimpleQueue(), self._limits)


def _answer_of(
    process: WorkerProcess, should_stop: ShouldStop, progress: Callable[[float], None]
) -> Message:
    """Waits for the result of the task of a process."""
    told_at = math.inf
    while True:
        event = next_event(process.events)
        # Checked after every message: a task may report its progress more often than that.
        if told_at == math.inf and process.ready and should_stop():
            process.stop()
            told_at = time.monotonic()
        if time.monotonic() - told_at > _GIVING_UP:
            process.kill()
        process.end_if_overdue()
        if event is None:
            continue
        message = event.message
        if message is None:
            how = process.how_it_ended()
            raise WorkerDiedError(how if told_at == math.inf else _TOO_LATE)
        if message.kind is Kind.READY:
            process.note_ready()
        elif message.kind is Kind.PROGRESS:
            progress(cast("float", message.unpack()))
        else:
            process.asked = None
            return message
