"""Interface of all executors: one function mapped over many tasks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock
from types import TracebackType
from typing import Generic, Protocol, Self, TypeVar

from slipgrasp.core.exceptions import SlipgraspError

AHEAD = 64
"""Smallest length of a window of tasks, from the oldest unfinished one to the newest."""

ATTEMPTS = 3
"""Number of attempts at a task whose worker dies."""

ATTEMPTS_IF_KILLED = 5
"""Number of attempts if the worker is killed from outside, for example for lack of memory."""

Task = TypeVar("Task")
Result = TypeVar("Result")

ShouldStop = Callable[[], bool]
TaskFunction = Callable[[Task, ShouldStop], Result]


class Caller(Protocol):
    """Connection of a task to its caller; calling it returns whether to stop."""

    def __call__(self) -> bool:
        """Whether the task should stop."""
        ...

    def report(self, share: float) -> None:
        """Reports the completed fraction of the task, 0 to 1."""
        ...


def never() -> bool:
    """Never stops a task."""
    return False


class ExecutorError(SlipgraspError):
    """An executor that does not exist or cannot work."""


class Cancelled(SlipgraspError):  # noqa: N818 - not an error, but a result
    """Raised by a function that stopped on request."""


@dataclass(frozen=True, slots=True)
class Finished(Generic[Task, Result]):
    """A task that will not be attempted again.

    Attributes:
        task: The task.
        result: Result of the function, None if it never finished.
        failure: Reason why there is no result, in one sentence; None if there is one.
    """

    task: Task
    result: Result | None
    failure: str | None = None


class Executor(Protocol):
    """An executor of tasks; a context manager that releases its workers at the end.

    Attributes:
        name: Name of the executor.
        num_workers: Number of concurrent tasks, as far as known.
    """

    name: str
    num_workers: int

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Starts all workers, as the first `map` would, and waits until they are ready.

        Args:
            should_stop: Called about 20 times a second; True ends the waiting, not the start.

        Returns:
            Time taken [s]; almost nothing if they were ready.

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
        """Executes all tasks, each exactly once from the caller's point of view.

        A task whose worker dies is attempted again, up to `ATTEMPTS` times (processes: up to
        `ATTEMPTS_IF_KILLED` times if it is killed); then it has failed, and the others continue.

        Args:
            function: A function of an imported module, not of the main script, that depends only on
                its task. It should call its second argument every few milliseconds, and raise
                `Cancelled` if that returns True.
            tasks: The tasks, taken one by one: at most `AHEAD`, or four per worker if that is more,
                from the oldest unfinished one to the newest.
            should_stop: Called about 20 times a second; True ends the iteration within half a
                second, without the unfinished tasks.

        Yields:
            The tasks in the order in which they finish.

        Raises:
            ExecutorError: If the workers cannot be started or reached, or serve another caller.
            Exception: Any exception of the function.
        """
        ...

    def close(self) -> None:
        """Releases the workers; unfinished work is lost."""
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
    """A context that reserves the workers for one caller.

    Args:
        at_work: Lock held while the workers are in use.
        workers: Name of the workers with a verb, for messages.

    Raises:
        ExecutorError: If the workers are in use.
    """
    if not at_work.acquire(blocking=False):
        raise ExecutorError(f"{workers} in use by another caller")
    try:
        yield
    finally:
        at_work.release()
