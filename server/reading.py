"""Recordings in memory: bounded together, and what several ask for is read once."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import anyio.to_thread
from anyio import CapacityLimiter

from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.file.stretch import Stretch, read_stretch
from slipgrasp.server.exceptions import ServiceBusyError

MAX_BYTES = 640_000_000
MAX_THREADS = 2
MAX_WAITING = 16
WAIT_SECONDS = 10.0
RETRY_AFTER = 5
SMALL_BYTES = 8_000_000
"""What needs less memory is read at once, whatever else is."""

READ_COST = 1.5
TABLE_COST = 4.0
DIFF_COST = 5.0
"""Memory for reading a recording, and for what is made of it, per byte of its file."""

ROW_COST = 1000
"""Memory for a run of a study in a map or summary, or in the part of a table written at once."""

UNPACKING_BYTES = 24_000_000
"""Memory for the chunk that is being unpacked, whatever is kept of it."""

POLL_SECONDS = 0.5

Value = TypeVar("Value")
_END = object()


class _Shared:
    """A stretch of a recording that is read, or was, for as long as somebody needs it."""

    def __init__(self) -> None:
        self.readers = 0
        self.is_left = threading.Event()
        self.result: asyncio.Future[Trace] = asyncio.get_running_loop().create_future()
        self.holder: asyncio.Task[None] | None = None


class RecordingReads:
    """Lets recordings be read as long as there is memory for them; belongs to one event loop.

    What needs more than there is at all is read alone.

    Args:
        max_bytes: How much memory they may take together.
        patience: How long a reader waits for its turn [s].
    """

    def __init__(self, max_bytes: int = MAX_BYTES, patience: float = WAIT_SECONDS) -> None:
        self._max_bytes = max_bytes
        self._patience = patience
        self._left = max_bytes
        self._waiting: deque[tuple[int, asyncio.Future[None]]] = deque()
        self._shared: dict[tuple[Any, ...], _Shared] = {}
        self._threads = CapacityLimiter(MAX_THREADS)
        self._loop = asyncio.get_running_loop()

    @asynccontextmanager
    async def shared(
        self,
        path: Path,
        run_id: str,
        stretch: Stretch,
        share: float,
        is_gone: Callable[[], Awaitable[bool]],
    ) -> AsyncIterator[Trace]:
        """Within it a part of a recording is in memory, once for all who need it at that time.

        Args:
            path: The recording.
            run_id: What to call it in errors.
            stretch: The part.
            share: How much of all its columns that is, 0 to 1.
            is_gone: Whether the client no longer waits for it.

        Raises:
            RecordingError: If there is none, or it is damaged.
            ServiceBusyError: If there is no memory for it for some time.
        """
        try:
            found = path.stat()
        except FileNotFoundError:
            raise RecordingNotFoundError(run_id) from None
        key = path, found.st_ino, found.st_size, found.st_mtime_ns, stretch
        entry = self._shared.get(key)
        if entry is None:
            entry = self._shared[key] = _Shared()
            cost = READ_COST * found.st_size
            cost = min(cost, share * cost + UNPACKING_BYTES)
            entry.holder = asyncio.create_task(self._hold(entry, path, stretch, round(cost)))
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

    async def _hold(self, entry: _Shared, path: Path, stretch: Stretch, num_bytes: int) -> None:
        """Reads from a file and keeps the memory taken until it is cancelled."""
        read = partial(read_stretch, path, stretch, should_stop=entry.is_left.is_set)
        try:
            async with self.room(num_bytes):
                result = await anyio.to_thread.run_sync(read, limiter=self._threads)
                if not entry.result.done():
                    entry.result.set_result(result)
                await asyncio.get_running_loop().create_future()
        except Exception as error:
            if not entry.result.done():
                entry.result.set_exception(error)
                # Nobody may be left to be told.
                entry.result.exception()

    async def in_threads(self, pieces: Iterator[Value]) -> AsyncIterator[Value]:
        """Makes pieces in few threads, so that who only wants to know how it is, is answered."""
        while True:
            piece: Any = await anyio.to_thread.run_sync(next, pieces, _END, limiter=self._threads)
            if piece is _END:
                return
            yield piece

    @asynccontextmanager
    async def room(self, num_bytes: int) -> AsyncIterator[None]:
        """Within it so much memory may be used.

        Raises:
            ServiceBusyError: If there is not as much for some time, or many wait already.
        """
        taken = await self._take(num_bytes)
        try:
            yield
        finally:
            self._give(taken)

    @contextmanager
    def room_in_thread(self, num_bytes: int) -> Iterator[None]:
        """What `room` is, for any other thread than that of the event loop."""
        taken = asyncio.run_coroutine_threadsafe(self._take(num_bytes), self._loop).result()
        try:
            yield
        finally:
            self._loop.call_soon_threadsafe(self._give, taken)

    async def _take(self, num_bytes: int) -> int:
        wanted = min(num_bytes, self._max_bytes)
        if wanted < SMALL_BYTES:
            return 0
        if wanted <= self._left and not self._waiting:
            self._left -= wanted
            return wanted
        if len(self._waiting) >= MAX_WAITING:
            raise self._busy()
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.append((wanted, turn))
        try:
            async with asyncio.timeout(self._patience):
                await turn
        except BaseException as error:
            if turn.done() and not turn.cancelled():
                self._give(wanted)
            else:
                # Whoever gave meanwhile may have passed over it.
                with suppress(ValueError):
                    self._waiting.remove((wanted, turn))
                self._give(0)
            if isinstance(error, TimeoutError):
                raise self._busy() from None
            raise
        return wanted

    def _give(self, num_bytes: int) -> None:
        self._left += num_bytes
        while self._waiting and self._waiting[0][0] <= self._left:
            wanted, turn = self._waiting.popleft()
            if not turn.cancelled():
                self._left -= wanted
                turn.set_result(None)

    def _busy(self) -> ServiceBusyError:
        waiting = len(self._waiting)
        return ServiceBusyError(waiting, RETRY_AFTER, "others wait for memory to read recordings")


async def _unless_gone(
    result: asyncio.Future[Trace], is_gone: Callable[[], Awaitable[bool]]
) -> Trace:
    while not result.done():
        await asyncio.wait([result], timeout=POLL_SECONDS)
        if not result.done() and await is_gone():
            raise ServiceBusyError(0, RETRY_AFTER, "wait for the recording any more")
    return result.result()
