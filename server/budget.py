"""A budget of memory for jobs whose memory grows with a run."""

from __future__ import annotations

import asyncio
import gc
import threading
import weakref
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import Future, TimeoutError
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, replace

from slipgrasp.core.executors.limits import machine_memory
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import diagnostics_of
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.recordings.export import ROWS_PER_GROUP
from slipgrasp.recordings.file.size import RecordingSize, size_of_run
from slipgrasp.server.exceptions import MemoryLimitError, ServiceBusyError

DEFAULT_BYTES = 600_000_000
SHARE_OF_MACHINE = 0.5
"""Default memory of all jobs together: the smaller of this fraction and `DEFAULT_BYTES`."""

HELD_SHARE = 0.75
"""Fraction of the budget for runs on pages; the rest is for requests."""

SMALL_BYTES = 8_000_000
"""Largest memory of a job that never waits, although it is counted [bytes]."""

MAX_WAITING = 16
WAIT_SECONDS = 10.0
POLL_SECONDS = 0.25

RECORDED_RUN_BYTES = 80_000_000
"""Memory of a run of any length whose samples are released once they are written [bytes]."""

UNPACKING_BYTES = 24_000_000
"""Memory of the chunk of a recording that is being decompressed [bytes]."""

MOST_DRAWN_WHOLE = 20_000
"""Samples of a run above which a figure reads only those that it needs."""

SPARE_SAMPLES = 5000
"""Samples of a run in addition to those at the output rate: at events and in slips."""

NUMBER_BYTES = 8

COLUMN_BYTES = 10
"""Memory of a number in a column, with the spare length of its array [bytes]."""

MOST_EXPORTED_WHOLE = 100_000
"""Samples of a recording above which a table is written while they are read."""

GROUP_COST = 8.0
"""Peak memory of writing a table, per byte of the rows that are written together."""

PAGE_BYTES = 60_000_000
"""Memory for writing a live page [bytes]."""

READ_COST = 2.3
DIFF_COST = 2.0
DRAW_COST = 5.0
TABLE_COST = 3.0
WORK_COST = 1.2
KEEP_COST = 2.2
"""Peak memory of reading, comparing, exporting, drawing and simulating, per byte of samples."""

ROW_COST = 1000
"""A run of a study in a map or summary, or in the part of a table written at once."""


@dataclass(frozen=True, slots=True)
class Need:
    """Memory needed by a job.

    Attributes:
        num_bytes: Amount of memory [bytes].
        job: The job, as the subject of a sentence.
        cure: Remedy: how to reduce it, or where to run the job; empty if there is none.
    """

    num_bytes: int
    job: str
    cure: str = ""

    @classmethod
    def to_keep_run(cls, scenario: Scenario) -> Need:
        """Need of simulating a run whose samples stay in memory, as the dashboard does."""
        samples = scenario.simulation.duration * scenario.simulation.output_rate
        period = scenario.controller.control_period
        ticks = scenario.simulation.duration / period if period > 0.0 else 0.0
        shape = TraceShape(
            len(scenario.fingers),
            tuple(estimate.parameter for estimate in scenario.estimates),
            diagnostics_of(scenario),
            scenario.space,
            scenario.sliding_joints,
            scenario.has_soft_fingers,
        )
        size = RecordingSize(shape, round(samples) + SPARE_SAMPLES, round(ticks))
        return cls(
            round(KEEP_COST * size.num_bytes),
            "this run",
            "choose a shorter duration or a lower simulation.output_rate, or record it with "
            "POST /runs, which keeps no samples in memory",
        )

    @classmethod
    def to_record_run(cls) -> Need:
        """Need of simulating a run whose samples are written to its file at once."""
        return cls(RECORDED_RUN_BYTES, "a run")

    @classmethod
    def to_open(cls, size: RecordingSize) -> Need:
        """Need of reading a whole recording for a page."""
        return cls(
            _unpacked(READ_COST * size.num_bytes),
            "this recording",
            "show it with 'slipgrasp replay' on a machine with more memory",
        )

    @classmethod
    def to_read_numbers(cls, count: int) -> Need:
        """Need of reading measured data."""
        return cls(_unpacked(READ_COST * NUMBER_BYTES * count), "this recording")

    @classmethod
    def to_read_signals(cls, size: RecordingSize, num_columns: int, share: float) -> Need:
        """Need of reading some columns of a part of a recording.

        Args:
            size: The recording.
            num_columns: Number of columns.
            share: Fraction of its time, 0 to 1.
        """
        samples = min(size.samples, round(share * size.samples) + SPARE_SAMPLES)
        return cls(
            _unpacked(COLUMN_BYTES * samples * num_columns),
            "this part of the recording",
            "request fewer signals in names, or a shorter time with t_from and t_to",
        )

    @classmethod
    def to_compare(cls, *sizes: RecordingSize) -> Need:
        """Need of comparing recordings sample by sample."""
        return cls(
            _unpacked(DIFF_COST * sum(size.num_bytes for size in sizes)),
            "this comparison",
            "draw it with GET /diff/figure, or compare the files with 'slipgrasp diff'",
        )

    @classmethod
    def to_draw(cls, *sizes: RecordingSize) -> Need:
        """Need of drawing overlaid recordings; of long ones only the samples that are drawn."""
        drawn = sum(
            size.num_bytes * min(1.0, MOST_DRAWN_WHOLE / max(size.samples, 1)) for size in sizes
        )
        return cls(_unpacked(DRAW_COST * drawn) + UNPACKING_BYTES, "this figure")

    @classmethod
    def to_export(cls, size: RecordingSize) -> Need:
        """Need of writing all samples in another format."""
        return cls(
            _unpacked(TABLE_COST * size.num_bytes),
            "this table",
            "request some signals or a part of the time with GET /runs/{id}/signals, or write it "
            "with 'slipgrasp export'",
        )

    @classmethod
    def to_export_long(cls, size: RecordingSize) -> Need:
        """Need of writing all samples in another format while reading them."""
        group = replace(size, samples=ROWS_PER_GROUP, ticks=0)
        return cls(_unpacked(GROUP_COST * group.num_bytes), "this table")

    @classmethod
    def to_work_on(cls, *runs: RunResult) -> Need:
        """Need of comparing or drawing runs that are in memory."""
        return cls(round(WORK_COST * sum(map(size_of_run, runs))), "this work")

    @classmethod
    def to_write_page(cls, run: RunResult) -> Need:
        """Need of writing a live page of a run that is in memory."""
        return cls(PAGE_BYTES + cls.to_work_on(run).num_bytes, "this page")

    @classmethod
    def for_rows(cls, count: int) -> Need:
        """Need of runs of a study in a map, a summary or a part of a table."""
        return cls(ROW_COST * count, "this map or table")


def default_limit() -> int:
    """The default memory of all jobs together [bytes]."""
    machine = machine_memory()
    return min(DEFAULT_BYTES, round(SHARE_OF_MACHINE * machine)) if machine else DEFAULT_BYTES


class Lease:
    """Memory reserved for a job; see `MemoryBudget.reserve`."""

    def __init__(self, budget: MemoryBudget, num_bytes: int) -> None:
        self._budget = budget
        self.num_bytes = num_bytes

    def keep(self, owner: object, num_bytes: int) -> None:
        """Extends a part of the lease until an object is deleted.

        Args:
            owner: The object, which takes a weak reference.
            num_bytes: Its memory; may exceed the lease.
        """
        self.num_bytes -= num_bytes
        self._budget.hold(num_bytes)
        weakref.finalize(owner, self._budget.let_go, num_bytes).atexit = False


class MemoryBudget:
    """A budget of memory; safe to use from any thread and any event loop.

    Jobs that do not fit wait in order, for a bounded time. Small jobs do not wait.

    Args:
        limit: Memory of all jobs together [bytes].
        patience: Longest waiting time of a job [s].
    """

    def __init__(self, limit: int, patience: float = WAIT_SECONDS) -> None:
        self.limit = limit
        self._patience = patience
        self._left = limit
        self._held = 0
        self._waiting: deque[tuple[int, Future[None]]] = deque()
        self._lock = threading.RLock()

    @property
    def left(self) -> int:
        """Free memory [bytes]; negative if leases were exceeded."""
        return self._left

    @property
    def held(self) -> int:
        """Memory that pages hold [bytes]."""
        return self._held

    def check(self, need: Need) -> None:
        """Checks whether a job is possible.

        Raises:
            MemoryLimitError: If it needs more than the limit.
        """
        if need.num_bytes > self.limit:
            raise MemoryLimitError(need.job, need.num_bytes, self.limit, need.cure)

    @contextmanager
    def reserve(self, need: Need, give_up: Callable[[], bool] | None = None) -> Iterator[Lease]:
        """Reserves the memory of a job while the context lasts; for threads.

        Args:
            need: The memory of the job.
            give_up: If given, the job waits without a time limit, and this function is called
                repeatedly; if it returns True the job continues without memory, to end at once.

        Raises:
            MemoryLimitError: If it needs more than the limit.
            ServiceBusyError: If the memory stays in use for some time, or too many jobs wait.
        """
        turn = self._ask(need, is_patient=give_up is not None)
        lease = Lease(self, need.num_bytes)
        left = self._patience
        while lease.num_bytes and not turn.done():
            with suppress(TimeoutError):
                turn.result(min(left, POLL_SECONDS))
            if give_up is None:
                left -= POLL_SECONDS
                if left <= 0.0 and self._leave(turn):
                    raise self._busy()
            elif give_up() and self._leave(turn):
                lease = Lease(self, 0)
        try:
            yield lease
        finally:
            self._give(lease.num_bytes)

    @asynccontextmanager
    async def reserve_async(self, need: Need) -> AsyncIterator[Lease]:
        """Reserves memory as `reserve` does, for coroutines."""
        turn = self._ask(need)
        try:
            async with asyncio.timeout(self._patience):
                await asyncio.shield(asyncio.wrap_future(turn))
        except BaseException as error:
            if not self._leave(turn):
                self._give(need.num_bytes)
            if isinstance(error, TimeoutError):
                raise self._busy() from None
            raise
        lease = Lease(self, need.num_bytes)
        try:
            yield lease
        finally:
            self._give(lease.num_bytes)

    @contextmanager
    def reserve_to_hold(self, need: Need, soon_free: int = 0) -> Iterator[Lease]:
        """Reserves memory for a job whose result is retained, in the part for pages.

        Args:
            need: The memory it needs, which is also the largest amount that it retains.
            soon_free: Memory of pages that is freed after the result is available.

        Raises:
            MemoryLimitError: If it needs more than the limit.
            ServiceBusyError: As in `reserve`, or if pages hold too much; the job does not wait for
                them.
        """
        self.check(need)
        most = round(HELD_SHARE * self.limit)
        if need.num_bytes > most - self._held + soon_free:
            # Closed pages may be in reference cycles.
            gc.collect()
        # A single page may use everything.
        held = self._held - soon_free
        if held > 0 and need.num_bytes > most - held:
            raise ServiceBusyError(
                f"no memory available: it needs {-(-need.num_bytes // 10**6)} MB, and open pages "
                f"use {held // 10**6} of {most // 10**6} MB; close another page, end a comparison "
                "or choose a short run"
            )
        with self.reserve(need) as lease:
            yield lease

    def hold(self, num_bytes: int) -> None:
        """Counts memory as used by pages."""
        with self._lock:
            self._held += num_bytes

    def let_go(self, num_bytes: int) -> None:
        """Releases memory of pages."""
        with self._lock:
            self._held -= num_bytes
            self._give(num_bytes)

    def _ask(self, need: Need, *, is_patient: bool = False) -> Future[None]:
        self.check(need)
        turn: Future[None] = Future()
        with self._lock:
            fits = need.num_bytes <= self._left and not self._waiting
            if fits or need.num_bytes < SMALL_BYTES:
                self._left -= need.num_bytes
                turn.set_result(None)
                return turn
            if len(self._waiting) >= MAX_WAITING and not is_patient:
                raise self._busy()
            self._waiting.append((need.num_bytes, turn))
        return turn

    def _leave(self, turn: Future[None]) -> bool:
        """Leaves the queue; returns False if its turn has already come."""
        with self._lock:
            if turn.done():
                return False
            turn.cancel()
            self._waiting = deque(entry for entry in self._waiting if entry[1] is not turn)
            # Smaller jobs may wait behind it.
            self._give(0)
        return True

    def _give(self, num_bytes: int) -> None:
        with self._lock:
            self._left += num_bytes
            while self._waiting and self._waiting[0][0] <= self._left:
                wanted, turn = self._waiting.popleft()
                self._left -= wanted
                turn.set_result(None)

    def _busy(self) -> ServiceBusyError:
        return ServiceBusyError(f"{len(self._waiting)} others wait for memory")


def _unpacked(num_bytes: float) -> int:
    return round(num_bytes) + UNPACKING_BYTES
