"""Tasks on a Dask cluster, for more than one machine."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from functools import partial
from importlib.util import find_spec
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from slipgrasp.core.executors.answers import ask, do, open_answer
from slipgrasp.core.executors.dask_connection import DaskConnection
from slipgrasp.core.executors.executor import (
    ATTEMPTS,
    Cancelled,
    Executor,
    ExecutorError,
    Finished,
    ShouldStop,
    TaskFunction,
    never,
    only_caller,
)
from slipgrasp.core.executors.messages import Kind, Message
from slipgrasp.core.executors.processes import MAX_WORKERS
from slipgrasp.core.executors.window import Attempt, Window, window_length
from slipgrasp.core.processors import available_processors
from slipgrasp.core.run.simulator import prepare_kernel

if TYPE_CHECKING:
    import distributed

Task = TypeVar("Task")
Result = TypeVar("Result")

_POLL = 0.05  # [s] between two checks whether to stop
_COUNT_AGAIN = 5.0  # [s] between two queries of the number of workers
_DEPTH = 2  # tasks per worker: the current one and the next, so that it never waits
_FETCHES = 4  # results fetched at a time


class _Answer(NamedTuple):
    """The response to a task."""

    number: int
    reply: Future[Message]


class DaskExecutor(Executor):
    """Executes tasks on a Dask cluster; see `slipgrasp.core.executors.executor.Executor`.

    The first `map` or `prepare` connects to the scheduler, or starts a cluster on this machine.
    Workers may join and leave.
    """

    name = "dask"

    def __init__(self, address: str | None = None, *, workers: int | None = None) -> None:
        """Creates the executor without starting anything.

        Args:
            address: Address of the scheduler, such as ``tcp://10.0.0.1:8786``; None starts a
                cluster.
            workers: Number of workers of a started cluster; one per processor if None.

        Raises:
            ExecutorError: If Dask is not installed, or the number is out of bounds.
        """
        if find_spec("distributed") is None:
            raise ExecutorError(
                "the executor 'dask' needs the package distributed: pip install 'slipgrasp[dask]'"
            )
        count = available_processors() if workers is None else workers
        if not 1 <= count <= MAX_WORKERS:
            raise ExecutorError(f"{count} workers are not possible; allowed: 1 … {MAX_WORKERS}")
        self.num_workers = count if address is None else 1
        self._connect = partial(_connect, address, count)
        self._connecting: Future[DaskConnection] | None = None
        self._threads = ThreadPoolExecutor(_FETCHES, thread_name_prefix="slipgrasp-dask")
        self._at_work = threading.Lock()
        self._round = 0

    def prepare(self, should_stop: ShouldStop = never) -> float:
        """Connects, waits until the workers are ready, and returns the time taken [s]."""
        started = time.perf_counter()
        with only_caller(self._at_work, "the Dask cluster is"):
            self._connected(should_stop)
        return time.perf_counter() - started

    def map(
        self,
        function: TaskFunction[Task, Result],
        tasks: Iterable[Task],
        *,
        should_stop: ShouldStop,
    ) -> Iterator[Finished[Task, Result]]:
        """Executes all tasks; see `slipgrasp.core.executors.executor.Executor.map`."""
        with only_caller(self._at_work, "the Dask cluster is"):
            connection = self._connected(should_stop)
            if connection is None:
                return
            self._round += 1
            mapping = _Map(connection, self._threads, self._round, function)
            try:
                yield from mapping.work(tasks, should_stop)
            finally:
                self.num_workers = mapping.num_workers
                mapping.give_up()

    def close(self) -> None:
        """Disconnects from the cluster; stops it if it was started here."""
        connecting, self._connecting = self._connecting, None
        if connecting is not None and connecting.exception() is None:
            connecting.result().close()
        self._threads.shutdown(cancel_futures=True)

    def _connected(self, should_stop: ShouldStop) -> DaskConnection | None:
        """Returns the connection, renewed if it was lost; None if a stop is requested meanwhile."""
        known = self._connecting
        if known is None or (known.done() and (known.exception() or known.result().is_lost)):
            known = self._connecting = self._threads.submit(self._connect)
        while not known.done():
            if should_stop():
                return None
            time.sleep(_POLL)
        connection = known.result()
        self.num_workers = max(1, connection.count_threads())
        return connection


class _Map:
    """One mapping of a function over tasks."""

    def __init__(
        self,
        connection: DaskConnection,
        threads: ThreadPoolExecutor,
        round: int,
        function: TaskFunction[Any, Any],
    ) -> None:
        self.num_workers = max(1, connection.count_threads())
        self._counted = time.monotonic()
        self._connection = connection
        self._threads = threads
        self._round = round
        self._function = function
        self._answers: SimpleQueue[_Answer] = SimpleQueue()
        self._at: dict[int, distributed.Future[Any]] = {}
        self._suspect: Attempt[Any] | None = None
        self._alone: int | None = None

    def work(self, tasks: Iterable[Task], should_stop: ShouldStop) -> Iterator[Finished[Task, Any]]:
        """Executes the tasks."""
        window = Window(tasks, window_length(self.num_workers))
        while not should_stop():
            if self._connection.is_lost:
                raise self._connection.lost_error()
            self._hand_out(window)
            if window.done:
                return
            try:
                answer = self._answers.get(timeout=_POLL)
            except Empty:
                self._count_workers()
            else:
                yield from self._note(answer, window)

    def give_up(self) -> None:
        """Cancels unfinished tasks on the cluster; the workers then stop them."""
        unfinished = list(self._at.values())
        self._at.clear()
        if unfinished and not self._connection.is_lost:
            self._connection.client.cancel(unfinished)

    def _hand_out(self, window: Window[Any]) -> None:
        """Submits as many tasks as the workers accept.

        When a worker dies, Dask cannot tell which task killed it, so a task at its last attempt is
        executed alone.
        """
        while self._alone not in self._at and len(self._at) < _DEPTH * self.num_workers:
            attempt, self._suspect = self._suspect or window.take(), None
            if attempt is None:
                return
            if attempt.is_last and self._at:
                self._suspect = attempt
                return
            self._alone = attempt.number if attempt.is_last else None
            self._submit(attempt)

    def _submit(self, attempt: Attempt[Any]) -> None:
        message = ask(self._round, attempt.number, self._function, attempt.task)
        future = self._connection.client.submit(_do_on_worker, message, pure=False)
        self._at[attempt.number] = future
        future.add_done_callback(partial(self._fetch, attempt.number))

    def _fetch(self, number: int, future: distributed.Future[Any]) -> None:
        """Fetches a result in another thread; Dask calls this when the result is available."""
        fetched = self._threads.submit(future.result)
        fetched.add_done_callback(lambda reply: self._answers.put(_Answer(number, reply)))

    def _note(self, answer: _Answer, window: Window[Task]) -> Iterator[Finished[Task, Any]]:
        from distributed import KilledWorker

        if self._at.pop(answer.number, None) is None:
            return
        error = answer.reply.exception()
        # Stopped without a request: the scheduler considered a slow worker dead.
        if isinstance(error, KilledWorker | Cancelled):
            if not window.note_death(answer.number):
                told = f"its worker died {ATTEMPTS} times"
                yield Finished(window.finish(answer.number), None, told)
        elif isinstance(error, CancelledError | OSError):
            raise self._connection.lost_error() from error
        else:
            result = open_answer(answer.reply.result())
            yield Finished(window.finish(answer.number), result)

    def _count_workers(self) -> None:
        if time.monotonic() - self._counted > _COUNT_AGAIN:
            self._counted = time.monotonic()
            self._connection.replace_lost_workers()
            self.num_workers = max(1, self._connection.count_threads())


def _connect(address: str | None, workers: int) -> DaskConnection:
    prepare_kernel()  # compiled once, also for the workers of this machine
    return DaskConnection(address, workers)


def _do_on_worker(asked: Message) -> Message:
    """Task function of a Dask worker, which returns exceptions of the function as results."""
    reply = do(asked, _given_up())
    if reply.kind is Kind.CANCELLED:
        raise Cancelled
    return reply


def _given_up() -> Callable[[], bool]:
    """Returns a check for a current task that is cancelled, or whose client is lost."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def given_up() -> bool:
        task = worker.state.tasks.get(key)
        return task is None or task.state not in ("executing", "long-running")

    return given_up
