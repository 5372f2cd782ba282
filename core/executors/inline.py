"""Sequential tasks in the calling process: for tests and debugging."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

from slipgrasp.core.executors.executor import (
    Cancelled,
    Executor,
    Finished,
    ShouldStop,
    TaskFunction,
    never,
)

Task = TypeVar("Task")
Result = TypeVar("Result")


class InlineExecutor(Executor):
    """Executes tasks in the calling process; see `slipgrasp.core.executors.executor.Executor`."""

    name = "inline"
    num_workers = 1

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Loads the kernel; returns the time taken [s]."""
        from slipgrasp.core.run.simulator import prepare_kernel

        started = time.perf_counter()
        prepare_kernel()
        return time.perf_counter() - started

    def map(
        self,
        function: TaskFunction[Task, Result],
        tasks: Iterable[Task],
        *,
        should_stop: ShouldStop,
    ) -> Iterator[Finished[Task, Result]]:
        """Executes all tasks in order."""
        for task in tasks:
            if should_stop():
                return
            try:
                result = function(task, should_stop)
            except Cancelled:
                return
            yield Finished(task, result)

    def close(self) -> None:
        """Does nothing: there are no workers to release."""
