"""Simulates the runs of a study, and writes their rows in order, each exactly once."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import takewhile

from slipgrasp.core.executors import Executor, ExecutorError
from slipgrasp.core.scenario.law_loading import refer_to
from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.task import StudyRun, StudyTask, lost_run, run_task
from slipgrasp.recordings.study.writer import RUNS_PER_CHUNK, StudyWriter

TASKS_PER_WORKER = 4
WRITE_INTERVAL = 1.0
"""Longest wait of a row for others that fill its chunk [s]."""

Watch = Callable[[StudyRow], None]
Keep = Callable[[StudyRun], str | None]


def schedule_runs(
    study: Study,
    executor: Executor,
    writer: StudyWriter,
    *,
    should_stop: Callable[[], bool],
    watch: Watch,
    keep: Keep,
) -> StudyEnd:
    """Simulates the runs that are not written yet.

    Args:
        study: The study.
        executor: Executor of the runs.
        writer: Writer of the rows; it is not finished here.
        should_stop: Called about 20 times a second; True ends the study with the rows so far.
        watch: Called with every new row after it is written.
        keep: Called with every run whose recording is to be stored, before its row is written;
            returns its id, or None if it could not be stored. It may be called again for a run
            whose row was lost.

    Returns:
        The end of the study: ``cancelled`` if it was stopped before its last row.

    Raises:
        ExecutorError: If there are no workers.
        RecordingWriteError: If the rows cannot be written.
    """
    tasks = _Tasks(study, writer.num_rows, executor.num_workers)
    rows = _OrderedRows(writer, watch, keep)

    def is_over() -> bool:
        rows.write_due()
        return should_stop()

    try:
        while tasks.has_more and not should_stop():
            for done in executor.map(run_task, tasks, should_stop=is_over):
                if done.result is not None:
                    rows.take(done.result)
                    tasks.put_back(done.task, len(done.result), at_a_time=len(done.result))
                elif len(done.task.values) == 1:
                    failure = done.failure or "the worker returned no result"
                    rows.take([lost_run(done.task.first, done.task.values[0], failure)])
                else:
                    tasks.put_back(done.task, 0, at_a_time=1)
    except ExecutorError:
        rows.write_rest()
        raise
    rows.write_rest()
    return writer.ending(rows.message)


class _Tasks(Iterator[StudyTask]):
    """The tasks of a study in order; remainders of started tasks come first."""

    def __init__(self, study: Study, first: int, num_workers: int) -> None:
        self._study = study
        self._next = first
        # Smaller tasks at the end, so that all workers stay busy even in a short study.
        share = math.ceil((study.num_runs - first) / (TASKS_PER_WORKER * max(num_workers, 1)))
        self._size = min(max(share, 1), RUNS_PER_CHUNK)
        self._left: deque[StudyTask] = deque()
        self._laws = tuple(refer_to(law) for law in study.custom_laws())

    @property
    def has_more(self) -> bool:
        """Whether there is a task that was not started yet."""
        return bool(self._left) or self._next < self._study.num_runs

    def __next__(self) -> StudyTask:
        if self._left:
            return self._left.popleft()
        if self._next >= self._study.num_runs:
            raise StopIteration
        first = self._next
        self._next = min(first + self._size, self._study.num_runs)
        return self._task(first, self._next)

    def put_back(self, task: StudyTask, num_done: int, *, at_a_time: int) -> None:
        """Divides the rest of a task into smaller tasks.

        Args:
            task: The task.
            num_done: Number of its finished runs.
            at_a_time: Number of runs of each smaller task; 1 isolates a faulty run.
        """
        end = task.first + len(task.values)
        for first in range(task.first + num_done, end, max(at_a_time, 1)):
            self._left.append(self._task(first, min(first + at_a_time, end)))

    def _task(self, first: int, end: int) -> StudyTask:
        return StudyTask(
            first=first,
            base=self._study.base,
            values=tuple(self._study.values_of(index) for index in range(first, end)),
            recordings=self._study.recordings,
            limits=self._study.limits,
            laws=self._laws,
        )


class _OrderedRows:
    """Passes rows to the writer chunk by chunk in the order of their runs."""

    def __init__(self, writer: StudyWriter, watch: Watch, keep: Keep) -> None:
        self._writer = writer
        self._watch = watch
        self._keep = keep
        self._waiting: dict[int, StudyRow] = {}
        self._written_at = time.monotonic()
        self._not_kept = 0

    @property
    def message(self) -> str:
        """The number of recordings that could not be stored, as text; empty if none."""
        return f"{self._not_kept} recordings could not be stored" if self._not_kept else ""

    def take(self, runs: list[StudyRun]) -> None:
        """Accepts the rows of a task, and writes available ones.

        Recordings are stored immediately, because waiting ones would fill the memory.
        """
        self._waiting |= {run.row.index: self._kept(run) for run in runs}
        self.write_due()

    def write_due(self) -> None:
        """Writes every full chunk of the file, and partial chunks if that takes long."""
        is_late = time.monotonic() - self._written_at >= WRITE_INTERVAL
        while rows := self._next_chunk(in_part=is_late):
            self._write(rows)

    def write_rest(self) -> None:
        """Writes all rows before the first missing one."""
        while rows := self._next_chunk(in_part=True):
            self._write(rows)

    def _write(self, rows: list[StudyRow]) -> None:
        self._writer.add(rows)
        self._written_at = time.monotonic()
        for row in rows:
            self._watch(row)

    def _next_chunk(self, *, in_part: bool) -> list[StudyRow]:
        """The next chunk, or its available part; empty if partial chunks are not allowed yet."""
        first = self._writer.num_rows
        end = min(first - first % RUNS_PER_CHUNK + RUNS_PER_CHUNK, self._writer.num_runs)
        ready = list(takewhile(self._waiting.__contains__, range(first, end)))
        if len(ready) < end - first and not in_part:
            return []
        return [self._waiting.pop(index) for index in ready]

    def _kept(self, run: StudyRun) -> StudyRow:
        if run.recording is None:
            return run.row
        run_id = self._keep(run)
        self._not_kept += run_id is None
        return replace(run.row, recording=run_id)
