"""Tasks in worker processes on this machine: the default."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Iterator
from queue import SimpleQueue
from typing import Any, TypeVar

from slipgrasp.core.executors.answers import ask, open_answer
from slipgrasp.core.executors.executor import (
    ATTEMPTS,
    ATTEMPTS_IF_KILLED,
    Executor,
    ExecutorError,
    Finished,
    ShouldStop,
    TaskFunction,
    never,
    only_caller,
)
from slipgrasp.core.executors.limits import WorkerLimits
from slipgrasp.core.executors.messages import Kind
from slipgrasp.core.executors.window import Window, window_length
from slipgrasp.core.executors.worker_process import Event, WorkerProcess, next_event
from slipgrasp.core.processors import available_processors

MAX_WORKERS = 1024

Task = TypeVar("Task")
Result = TypeVar("Result")

_POLL = 0.05  # [s] between two checks whether to stop
_GIVING_UP = 0.3  # [s] until a worker that does not cancel its task is killed
_STARTS = 3  # successive workers that exit before they are ready
_KILLED_STARTS = 30  # the same for workers that are killed from outside
_FIRST_PAUSE, _LONGEST_PAUSE = 0.1, 5.0  # [s] before the next is started; doubles each time


class ProcessExecutor(Executor):
    """Executes tasks in processes; see `slipgrasp.core.executors.executor.Executor`.

    Processes start on first use and are kept for the next `map`. A worker that dies is replaced
    without affecting others; one that exceeds its limits is killed, and its task fails.
    """

    name = "processes"

    def __init__(self, workers: int | None = None, limits: WorkerLimits | None = None) -> None:
        """Creates the executor without starting anything.

        Args:
            workers: Number of processes; as many as there are processors if None.
            limits: Limits of each process; a fraction of the machine if None.

        Raises:
            ExecutorError: If the number is out of bounds.
        """
        count = available_processors() if workers is None else workers
        if not 1 <= count <= MAX_WORKERS:
            raise ExecutorError(f"{count} workers are not possible; allowed: 1 … {MAX_WORKERS}")
        self.num_workers = count
        self._limits = limits or WorkerLimits.shared_by(count)
        self._workers: list[WorkerProcess | None] = [None] * count
        self._events: SimpleQueue[Event] = SimpleQueue()
        self._at_work = threading.Lock()
        self._round = 0
        self._failed_starts = 0
        self._killed_starts = 0
        self._starts_from = 0.0
        self._closed = False

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Starts all workers and waits until each is ready, or until `should_stop`.

        Returns:
            Time taken [s].

        Raises:
            ExecutorError: If the workers are in use, are stopped or cannot be started.
        """
        started = time.perf_counter()
        with only_caller(self._at_work, "the worker processes are"):
            self._compile_kernel(should_stop)
            while not should_stop() and not self._all_ready():
                for place, worker in enumerate(self._workers):
                    if worker is None and self._may_start():
                        self._workers[place] = self._start()
                if (event := next_event(self._events)) is not None:
                    self._note_life(event)
        return time.perf_counter() - started

    def map(
        self,
        function: TaskFunction[Task, Result],
        tasks: Iterable[Task],
        *,
        should_stop: ShouldStop,
    ) -> Iterator[Finished[Task, Result]]:
        """Executes all tasks; see `slipgrasp.core.executors.executor.Executor.map`."""
        window = Window(tasks, window_length(self.num_workers))
        with only_caller(self._at_work, "the worker processes are"):
            self._round += 1
            try:
                if self._compile_kernel(should_stop):
                    yield from self._work(function, window, should_stop)
            finally:
                self._give_up()

    def close(self) -> None:
        """Stops the workers, with their tasks, permanently."""
        self._closed = True
        workers = [worker for worker in self._workers if worker is not None]
        self._workers = [None] * self.num_workers
        for worker in workers:
            worker.close()
        for worker in workers:
            worker.how_it_ended()

    def _all_ready(self) -> bool:
        return all(worker is not None and worker.ready for worker in self._workers)

    def _compile_kernel(self, should_stop: ShouldStop) -> bool:
        """Compiles the kernel once for all workers; False if a stop is requested meanwhile."""
        from slipgrasp.core.run.simulator import kernel_is_cached, prepare_kernel

        if kernel_is_cached():
            return True
        thread = threading.Thread(target=prepare_kernel, daemon=True)
        thread.start()
        while thread.is_alive():
            if should_stop():
                return False
            thread.join(_POLL)
        return True

    def _work(
        self,
        function: TaskFunction[Task, Result],
        window: Window[Task],
        should_stop: ShouldStop,
    ) -> Iterator[Finished[Task, Result]]:
        if not should_stop():
            self._hand_out(function, window)
        while not (should_stop() or window.done):
            event = next_event(self._events)
            finished = [] if event is None else list(self._note(event, window))
            # First, so that no worker waits for the caller.
            self._hand_out(function, window)
            yield from finished
            for worker in self._busy():
                worker.end_if_overdue()

    def _hand_out(self, function: TaskFunction[Task, Result], window: Window[Task]) -> None:
        """Assigns tasks to idle workers, and starts missing workers."""
        for place, worker in enumerate(self._workers):
            if self._may_start() if worker is None else worker.asked is None:
                if (attempt := window.take()) is None:
                    return
                message = ask(self._round, attempt.number, function, attempt.task)
                worker = self._workers[place] = worker or self._start()
                worker.do(message)

    def _may_start(self) -> bool:
        return time.monotonic() >= self._starts_from

    def _start(self) -> WorkerProcess:
        if self._closed:
            raise ExecutorError("the worker processes have been stopped")
        return WorkerProcess(self._events, self._limits)

    def _note(self, event: Event, window: Window[Task]) -> Iterator[Finished[Task, Any]]:
        """Updates the tasks after an event, and yields those that it finishes."""
        worker, message = event
        if worker not in self._workers:
            return
        self._note_life(event)
        if message is None:
            yield from self._note_death(worker, window)
        elif message.round == self._round:
            worker.asked = None
            yield Finished(window.finish(message.number), open_answer(message))

    def _note_life(self, event: Event) -> None:
        """Updates the worker after an event.

        Raises:
            ExecutorError: If it is the last of several that exited before they were ready.
        """
        worker, message = event
        if message is None:
            self._forget(worker)
        elif message.kind is Kind.READY:
            worker.note_ready()
            self._failed_starts = self._killed_starts = 0

    def _forget(self, worker: WorkerProcess) -> None:
        """Removes a worker that has exited, so that another one is started in its place.

        Raises:
            ExecutorError: If it is the last of several that exited before they were ready.
        """
        if worker not in self._workers:
            return
        self._workers[self._workers.index(worker)] = None
        how = worker.how_it_ended()
        if not worker.ready:
            self._note_failed_start(worker.was_killed())
        if self._failed_starts >= _STARTS or self._killed_starts >= _KILLED_STARTS:
            raise ExecutorError(
                f"worker processes cannot be started: the last worker {how} before its first task; "
                "its messages are on standard error"
            )

    def _note_failed_start(self, was_killed: bool) -> None:
        """Counts a failed start, and delays the next one if the worker was killed.

        The cause of a kill is often temporary, so the delay doubles with each kill.
        """
        if not was_killed:
            self._failed_starts += 1
            return
        self._killed_starts += 1
        pause = min(_FIRST_PAUSE * 2 ** (self._killed_starts - 1), _LONGEST_PAUSE)
        self._starts_from = time.monotonic() + pause

    def _note_death(
        self, worker: WorkerProcess, window: Window[Task]
    ) -> Iterator[Finished[Task, Any]]:
        """Requeues the task of a dead worker, or yields it as failed.

        It has failed if it exceeded a limit, or if this was its last attempt.
        """
        if worker.asked is None:
            return
        number = worker.asked.number
        if not worker.ready:
            window.put_back(number)
            return
        how = worker.how_it_ended()
        attempts = ATTEMPTS_IF_KILLED if worker.was_killed() else ATTEMPTS
        if worker.went_too_far():
            yield Finished(window.finish(number), None, f"its worker {how}")
        elif not window.note_death(number, attempts):
            told = f"its worker died {attempts} times; the last worker {how}"
            yield Finished(window.finish(number), None, told)

    def _give_up(self) -> None:
        """Makes the workers cancel their tasks; kills those that do not."""
        deadline = time.monotonic() + _GIVING_UP
        for worker in self._busy():
            worker.stop()
        while self._busy() and time.monotonic() < deadline:
            if (event := next_event(self._events)) is None:
                continue
            self._note_life(event)
            if event.message is None or event.message.round == self._round:
                event.worker.asked = None
        for worker in self._busy():
            worker.kill()
            self._forget(worker)

    def _busy(self) -> list[WorkerProcess]:
        return [worker for worker in self._workers if worker is not None and worker.asked]
