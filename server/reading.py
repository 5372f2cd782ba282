"""Signals of recordings in memory, shared by concurrent requests."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import anyio.to_thread
from anyio import CapacityLimiter

from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.file.segment import Segment, read_segment
from slipgrasp.server.budget import MemoryBudget, Need
from slipgrasp.server.exceptions import ServiceBusyError

MAX_THREADS = 2
POLL_SECONDS = 0.5

Value = TypeVar("Value")
_END = object()


class _Shared:
    """A segment of a recording, shared by all readers that need it."""

    def __init__(self) -> None:
        self.readers = 0
        self.is_left = threading.Event()
        self.result: asyncio.Future[Trace] = asyncio.get_running_loop().create_future()
        self.holder: asyncio.Task[None] | None = None


class RecordingReads:
    """Reads parts of recordings within the memory budget; belongs to one event loop.

    Args:
        memory: The memory budget.
    """

    def __init__(self, memory: MemoryBudget) -> None:
        self._memory = memory
        self._shared: dict[tuple[Any, ...], _Shared] = {}
        self._threads = CapacityLimiter(MAX_THREADS)

    @asynccontextmanager
    async def shared(
        self,
        path: Path,
        run_id: str,
        segment: Segment,
        need: Need,
        is_gone: Callable[[], Awaitable[bool]],
    ) -> AsyncIterator[Trace]:
        """A context with a part of a recording in memory, shared by concurrent readers.

        Args:
            path: The recording.
            run_id: Id of the run, for errors.
            segment: The part.
            need: Its memory.
            is_gone: Whether the client no longer waits for it.

        Raises:
            RecordingError: If the recording does not exist, or is damaged.
            MemoryLimitError: If it needs more memory than the budget.
            ServiceBusyError: If the memory stays in use for some time.
        """
        try:
            found = path.stat()
        except FileNotFoundError:
            raise RecordingNotFoundError(run_id) from None
        key = path, found.st_ino, found.st_size, found.st_mtime_ns, segment
        entry = self._shared.get(key)
        if entry is None:
            entry = self._shared[key] = _Shared()
            entry.holder = asyncio.create_task(self._hold(entry, path, segment, need))
        entry.readers += 1
        try:
            yield await _unless_gone(entry.result, is_gone)
        finally:
            entry.readers -= 1
            if entry.readers == 0:
                del self._shared[key]
                entry.is_left.set()
                if entry.holder is not None:
                    entry.holder.cancel()

    async def _hold(self, entry: _Shared, path: Path, segment: Segment, need: Need) -> None:
        """Reads from a file and retains the memory until it is cancelled."""
        read = partial(read_segment, path, segment, should_stop=entry.is_left.is_set)
        try:
            async with self._memory.reserve_async(need):
                result = await anyio.to_thread.run_sync(read, limiter=self._threads)
                if not entry.result.done():
                    entry.result.set_result(result)
                await asyncio.get_running_loop().create_future()
        except Exception as error:
            if not entry.result.done():
                entry.result.set_exception(error)
                # There may be no reader left.
                entry.result.exception()

    async def in_threads(self, pieces: Iterator[Value]) -> AsyncIterator[Value]:
        """Encodes pieces in few threads, so that short requests do not wait."""
        while True:
            piece: Any = await anyio.to_thread.run_sync(next, pieces, _END, limiter=self._threads)
            if piece is _END:
                return
            yield piece


async def _unless_gone(
    result: asyncio.Future[Trace], is_gone: Callable[[], Awaitable[bool]]
) -> Trace:
    while not result.done():
        await asyncio.wait([result], timeout=POLL_SECONDS)
        if not result.done() and await is_gone():
            raise ServiceBusyError("nobody waits for the recording any more")
    return result.result()
