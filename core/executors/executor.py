"""What every engine offers: one function mapped over many tasks, wherever they are done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock
from types import TracebackType
from typing import Generic, Protocol, Self, TypeVar

from slipgrasp.core.exceptions import SlipgraspError

AHEAD = 64
"""How far, at least, tasks are taken beyond the oldest that is not finished."""

ATTEMPTS = 3
"""How often a task is tried whose worker dies."""

ATTEMPTS_IF_KILLED = 5
"""Likewise, where somebody kills it: the system short of memory, or a person; not its own fault."""

Task = TypeVar("Task")
Result = TypeVar("Result")

ShouldStop = Callable[[], bool]
TaskFunction = Callable[[Task, ShouldStop], Result]


class Caller(Protocol):
    """The caller of a task, as its function sees it: called, it returns whether to stop."""

    def __call__(self) -> bool:
        """Whether the task is to come to an end."""
        ...

    def report(self, share: float) -> None:
        """Reports the share of the task that is done, 0 to 1."""
        ...


def never() -> bool:
    """A caller that never stops its task."""
    return False


class ExecutorError(SlipgraspError):
    """There is no such engine, or it cannot work."""


class Cancelled(SlipgraspError):  # noqa: N818 - it is no error, but an answer
    """A function gave up because it was asked to."""


@dataclass(frozen=True, slots=True)
class Finished(Generic[Task, Result]):
    """A task that will not be tried any more.

    Attributes:
        task: The task.
        result: What the function gave, None if it never came to an end.
        failure: Why there is no result, in one sentence; None if there is one.
    """

    task: Task
    result: Result | None
    failure: str | None = None


class Executor(Protocol):
    """An engine that does tasks; a context manager, whose end lets go of its workers.

    Attributes:
        name: What it is called.
        num_workers: How many tasks it does at a time, as far as known.
    """

    name: str
    num_workers: int

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Starts all workers, as the first `map` would, and waits until they are warm.

        Args:
            should_stop: Asked about 20 times a second; True ends the waiting, not the start.

        Returns:
            How long that took, almost nothing if they were [s].

        Raises:
            ExecutorError: If they cannot be started or reached.
        """
        ...

    def map(
        self,
        function: TaskFunction[Task, Result],
        tasks: Iterable[Task],
        *,
        should_stop: ShouldStop,
    ) -> Iterator[Finished[Task, Result]]:
        """Does all tasks, each exactly once as far as the caller can tell.

        A worker that dies costs the task it was at, which is tried again, `ATTEMPTS` times
        in all; then it has failed, and the others go on.

        Args:
            function: A function of an imported module, not of the script that is run. It
                depends on nothing but its task. Its second argument is to be asked every few
                milliseconds whether to give up, by raising `Cancelled`.
            tasks: What to do, taken one by one: at most `AHEAD`, or four per worker where
                that is more, beyond the oldest task that is not finished.
            should_stop: Asked about 20 times a second; True ends the iteration within half a
                second, without the tasks that are not finished.

        Yields:
            The tasks, in the order in which they are finished.

        Raises:
            ExecutorError: If the workers cannot be started or reached, or are at work
                already for another caller.
            Exception: What the function raised, whatever it is.
        """
        ...

    def close(self) -> None:
        """Lets go of the workers; what they are at is lost."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


@contextmanager
def only_caller(at_work: Lock, workers: str) -> Iterator[None]:
    """Within it nobody else can have the workers.

    Args:
        at_work: Held by the user of the workers.
        workers: What to call them.

    Raises:
        ExecutorError: If somebody has them.
    """
    if not at_work.acquire(blocking=False):
        raise ExecutorError(f"{workers} at work for another caller already")
    try:
        yield
    finally:
        at_work.release()
