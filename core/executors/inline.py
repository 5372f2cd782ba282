"""One task after the other, in the calling process: for tests and for finding errors."""

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
    """Does tasks where they are asked for; see `slipgrasp.core.executors.executor.Executor`."""

    name = "inline"
    num_workers = 1

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Loads the kernel."""
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
        """Does all tasks in their order."""
        for task in tasks:
            if should_stop():
                return
            try:
                result = function(task, should_stop)
            except Cancelled:
                return
            yield Finished(task, result)

    def close(self) -> None:
        """There is nothing to let go of."""
