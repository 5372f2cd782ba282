"""Events of a study or a fit while it runs: progress, its new rows, and its end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from typing import Any, Generic, TypeVar

from anyio import CapacityLimiter, to_thread
from fastapi import Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.server.http.events import HEARTBEAT, EventSlots, EventStream, encode_event
from slipgrasp.server.jobs.job import JobStatus, StudyState

LOOK_EVERY = 0.25
ROWS_AT_ONCE = 100

StatusT = TypeVar("StatusT", bound=JobStatus)


async def has_nothing_new(look: Callable[[], JobStatus], last_event_id: str) -> bool:
    """True if ``Last-Event-ID`` is that of the end of a job."""
    status = await run_in_threadpool(look)
    return status.state.has_ended and bool(last_event_id) and int(last_event_id) > status.finished


async def stream_events(
    look: Callable[[], StatusT],
    describe: Callable[[StatusT], dict[str, Any]],
    rows_from: Callable[[int, int], list[dict[str, Any]]] | None,
    last_event_id: str,
    heartbeat: float,
    stopping: asyncio.Event,
    slots: EventSlots,
) -> Response:
    """The events of a job as a response.

    Args:
        look: Returns the progress of the job.
        describe: Converts the progress to plain values.
        rows_from: Returns rows, given the first number and the largest count; None sends no rows.
        last_event_id: Id of the last event that the client received; empty for a new client.
        heartbeat: Time without events after which a comment is sent [s].
        stopping: Set when the server stops.
        slots: Number of open streams.

    Raises:
        ServiceBusyError: If too many streams are open.
    """
    status = await run_in_threadpool(look)
    # Unsent events follow.
    seen = min(int(last_event_id), status.finished) if last_event_id else None
    events = JobEvents(look, describe, rows_from, seen, heartbeat, slots.makers)
    return EventStream(events.pieces(partial(_pause, stopping)), slots)


async def _pause(stopping: asyncio.Event, seconds: float) -> bool:
    """Waits; returns True if the server ends meanwhile."""
    try:
        async with asyncio.timeout(seconds):
            return await stopping.wait()
    except TimeoutError:
        return False


class JobEvents(Generic[StatusT]):
    """Sends the events of a job to one client until it has ended.

    The id of an event is the number of finished runs, so that a client that lost its connection
    continues there.

    Args:
        look: Returns the progress of the job.
        describe: Converts the progress to plain values.
        rows_from: Returns rows, given the first number and the largest count; None sends no rows.
        seen: Number of runs whose events the client received; None for a new client.
        heartbeat: Time of silence after which a comment is sent [s].
        makers: Threads that encode rows.
    """

    def __init__(
        self,
        look: Callable[[], StatusT],
        describe: Callable[[StatusT], dict[str, Any]],
        rows_from: Callable[[int, int], list[dict[str, Any]]] | None,
        seen: int | None,
        heartbeat: float,
        makers: CapacityLimiter,
    ) -> None:
        self._look = look
        self._describe = describe
        self._rows_from = rows_from
        self._seen = seen or 0
        self._state = None if seen is None else StudyState.RUNNING
        self._heartbeat = heartbeat
        self._makers = makers

    async def pieces(self, pause: Callable[[float], Awaitable[bool]]) -> AsyncIterator[bytes]:
        """The encoded events.

        Args:
            pause: Waits for at most this number of seconds; returns True if the service ends.
        """
        spoken = time.monotonic()
        while True:
            status = await run_in_threadpool(self._look)
            async for event in self._news(status):
                spoken = time.monotonic()
                yield event
            if status.state.has_ended:
                return
            if time.monotonic() - spoken >= self._heartbeat:
                spoken = time.monotonic()
                yield HEARTBEAT
            if await pause(LOOK_EVERY):
                return

    async def _news(self, status: StatusT) -> AsyncIterator[bytes]:
        is_further = status.finished > self._seen
        while self._rows_from is not None and status.finished > self._seen:
            # Encoded there too, because many rows for many clients would block the event loop.
            yield await to_thread.run_sync(
                self._next_rows, self._rows_from, status.finished, limiter=self._makers
            )
        if status.state.has_ended:
            # One more than the number of runs: after this id there are no events.
            yield encode_event("end", self._describe(status), status.finished + 1)
        elif is_further or status.state is not self._state:
            # The event with its rows already has the id of this run.
            is_new = is_further and self._rows_from is None
            told = status.finished if is_new else None
            yield encode_event("progress", self._describe(status), told)
        self._seen, self._state = max(status.finished, self._seen), status.state

    def _next_rows(self, rows_from: Callable[[int, int], list[dict[str, Any]]], end: int) -> bytes:
        rows = rows_from(self._seen, min(ROWS_AT_ONCE, end - self._seen))
        self._seen += len(rows)
        return encode_event("rows", {"rows": rows}, self._seen)
