"""Events of a study or a fit while it runs: progress, its new rows, and its end.

They are server-sent events (WHATWG HTML, section 9.2).
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Any

from anyio import CapacityLimiter, to_thread
from fastapi import Response
from fastapi.sse import EventSourceResponse, format_sse_event
from starlette.concurrency import run_in_threadpool
from starlette.types import Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.jobs.job import StatusT, StudyState
from slipgrasp.server.settings import Settings

LOOK_EVERY = 0.25
ROWS_AT_ONCE = 100
HEARTBEAT = format_sse_event(comment="still here")

RowsFrom = Callable[[int, int], list[dict[str, Any]]]
"""Returns rows, given the first number and the largest count."""


def encode_event(kind: str, data: Any, event_id: int | None = None) -> bytes:
    """An event to send.

    Args:
        kind: Name, which browsers call the event's type.
        data: Plain values for JSON; numbers are finite.
        event_id: Id with which a client may continue; None keeps the previous one.
    """
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    told = None if event_id is None else str(event_id)
    return format_sse_event(event=kind, data_str=text, id=told)


class EventStream(EventSourceResponse):
    """A response that lasts as long as its events, or until its client disconnects.

    FastAPI supports generators of events, but then sends comments after 15 s of silence, regardless
    of settings, and cannot respond with 204 to a client that has seen the end.

    Args:
        pieces: The encoded events.
        slots: Counts further streams that may open, without this one during the response.
    """

    def __init__(self, pieces: AsyncIterator[bytes], slots: asyncio.Semaphore) -> None:
        # Proxies must not buffer the response.
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(pieces, headers=headers)
        self._slots = slots

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Sends the events; cancelled when the client disconnects."""
        async with self._slots:
            await super().__call__(scope, receive, send)


def event_responses(events: str) -> dict[int | str, dict[str, Any]]:
    """Declares that a route responds with events, which are described by a text."""
    content = {"text/event-stream": {"schema": {"type": "string"}}}
    return {
        200: {"description": events, "content": content},
        204: {"description": "`Last-Event-ID` is that of the end: there are no more events"},
        **ProblemPublic.responses((404, 422, 503)),
    }


@dataclass(frozen=True, slots=True)
class EventRequest:
    """A request for the events of a job, which are sent until the job has ended.

    The id of an event is the number of finished runs, so that a client that lost its connection
    continues there.

    Attributes:
        last_event_id: Id of the last event that the client received; empty for a new client.
        settings: The limits of streams.
        stopping: Set when the server stops.
        slots: Counts further streams that may open.
        makers: Threads that encode rows: few, and separate from those of requests, which would
            otherwise wait.
    """

    last_event_id: str
    settings: Settings
    stopping: asyncio.Event
    slots: asyncio.Semaphore
    makers: CapacityLimiter

    async def answer(
        self,
        look: Callable[[], StatusT],
        describe: Callable[[StatusT], dict[str, Any]],
        rows_from: RowsFrom | None = None,
    ) -> Response:
        """The events, or 204 if the client has received the end of the job.

        Args:
            look: Returns the progress of the job.
            describe: Converts the progress to plain values.
            rows_from: Returns rows; None sends no rows.

        Raises:
            ServiceBusyError: If too many streams are open.
        """
        status = await run_in_threadpool(look)
        seen = int(self.last_event_id) if self.last_event_id else None
        if status.state.has_ended and seen is not None and seen > status.finished:
            return Response(status_code=204)
        if self.slots.locked():
            limit = self.settings.max_event_streams
            raise ServiceBusyError(f"{limit} streams of events are open already")
        # Unsent events follow.
        seen = None if seen is None else min(seen, status.finished)
        return EventStream(self._pieces(look, describe, rows_from, seen), self.slots)

    async def _pieces(
        self,
        look: Callable[[], StatusT],
        describe: Callable[[StatusT], dict[str, Any]],
        rows_from: RowsFrom | None,
        seen: int | None,
    ) -> AsyncIterator[bytes]:
        """The encoded events after a number of runs; None for a new client."""
        state = None if seen is None else StudyState.RUNNING
        seen, spoken = seen or 0, time.monotonic()
        while True:
            status = await run_in_threadpool(look)
            is_further = status.finished > seen
            while rows_from is not None and status.finished > seen:
                count = min(ROWS_AT_ONCE, status.finished - seen)
                # Encoded there too, because many rows for many clients would block the event loop.
                rows, seen = await to_thread.run_sync(
                    _encode_rows, rows_from, seen, count, limiter=self.makers
                )
                yield rows
            if status.state.has_ended:
                # One more than the number of runs: after this id there are no events.
                yield encode_event("end", describe(status), status.finished + 1)
                return
            if is_further or status.state is not state:
                # The event with its rows already has the id of this run.
                told = status.finished if is_further and rows_from is None else None
                yield encode_event("progress", describe(status), told)
                spoken = time.monotonic()
            seen, state = max(status.finished, seen), status.state
            if time.monotonic() - spoken >= self.settings.event_heartbeat:
                spoken = time.monotonic()
                yield HEARTBEAT
            if await self._is_stopping():
                return

    async def _is_stopping(self) -> bool:
        """Waits until the next look; returns True if the server stops meanwhile."""
        try:
            async with asyncio.timeout(LOOK_EVERY):
                return await self.stopping.wait()
        except TimeoutError:
            return False


def _encode_rows(rows_from: RowsFrom, start: int, count: int) -> tuple[bytes, int]:
    """The event with some rows, and the number of rows up to its end."""
    rows = rows_from(start, count)
    end = start + len(rows)
    return encode_event("rows", {"rows": rows}, end), end
