"""Server-sent events (WHATWG HTML, section 9.2): encoding and lifetime."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from typing import Any

from anyio import CapacityLimiter
from fastapi.sse import EventSourceResponse, format_sse_event
from starlette.types import Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceBusyError

HEARTBEAT = format_sse_event(comment="still here")
MAX_MAKERS = 1


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


class EventSlots:
    """The number of open event streams; for use in the event loop only.

    Args:
        limit: Largest number.

    Attributes:
        num_open: Number of open streams.
        makers: Threads that encode slow events.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self.num_open = 0
        # Few, and separate from those of requests, which would otherwise wait.
        self.makers = CapacityLimiter(MAX_MAKERS)

    def check(self) -> None:
        """Checks whether another stream may open.

        Raises:
            ServiceBusyError: If there are too many.
        """
        if self.num_open >= self._limit:
            raise ServiceBusyError(f"{self.num_open} streams of events are open already")


class EventStream(EventSourceResponse):
    """A response that lasts as long as its events, or until its client disconnects.

    FastAPI supports generators of events, but then sends comments after 15 s of silence, regardless
    of settings, and cannot respond with 204 to a client that has seen the end.

    Args:
        pieces: The encoded events.
        slots: Counts the stream as open during the response.
    """

    def __init__(self, pieces: AsyncIterator[bytes], slots: EventSlots) -> None:
        # Proxies must not buffer the response.
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(pieces, headers=headers)
        self._slots = slots

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Sends the events; cancelled when the client disconnects."""
        self._slots.num_open += 1
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._slots.num_open -= 1
