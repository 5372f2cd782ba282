"""Order of tasks: taken lazily, attempted again after the death of a worker."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

from slipgrasp.core.executors.executor import AHEAD, ATTEMPTS

Task = TypeVar("Task")

_PER_WORKER = 4


def window_length(num_workers: int) -> int:
    """Largest number of tasks from the oldest unfinished one, included, to the newest."""
    return max(AHEAD, _PER_WORKER * num_workers)


class Attempt(NamedTuple, Generic[Task]):
    """A task to start.

    Attributes:
        number: Index of the task.
        task: The task.
        is_last: Whether this is attempt `ATTEMPTS`, the last one unless its worker is killed.
    """

    number: int
    task: Task
    is_last: bool = False


class Window(Generic[Task]):
    """The tasks that are taken and not finished."""

    def __init__(self, tasks: Iterable[Task], length: int) -> None:
        """Creates an empty window.

        Args:
            tasks: All tasks.
            length: Largest number of tasks from the oldest unfinished one, included, to the newest.
        """
        self._source = iter(tasks)
        self._length = length
        self._unfinished: dict[int, Task] = {}
        self._deaths: dict[int, int] = {}
        self._again: deque[int] = deque()
        self._num_taken = 0
        self._exhausted = False

    @property
    def done(self) -> bool:
        """Whether all tasks are finished; known once `take` has returned None."""
        return self._exhausted and not self._unfinished

    def take(self) -> Attempt[Task] | None:
        """The task to start now; None if there is none, or if the oldest must finish first."""
        if self._again:
            number = self._again.popleft()
            is_last = self._deaths.get(number, 0) == ATTEMPTS - 1
            return Attempt(number, self._unfinished[number], is_last)
        if self._exhausted or self._is_full():
            return None
        for task in self._source:
            number = self._num_taken
            self._num_taken += 1
            self._unfinished[number] = task
            return Attempt(number, task)
        self._exhausted = True
        return None

    def finish(self, number: int) -> Task:
        """Removes and returns the finished task with this number."""
        self._deaths.pop(number, None)
        return self._unfinished.pop(number)

    def put_back(self, number: int) -> None:
        """Requeues a task that was not started, without counting an attempt."""
        self._again.append(number)

    def note_death(self, number: int, attempts: int = ATTEMPTS) -> bool:
        """Counts the death of a worker at this task, and requeues the task unless it has failed.

        Args:
            number: The task.
            attempts: Number of attempts for this kind of death.

        Returns:
            Whether the task is attempted again.
        """
        deaths = self._deaths.get(number, 0) + 1
        self._deaths[number] = deaths
        if deaths < attempts:
            self._again.append(number)
        return deaths < attempts

    def _is_full(self) -> bool:
        oldest = next(iter(self._unfinished), self._num_taken)
        return self._num_taken - oldest >= self._length
