"""Server-sent events (WHATWG HTML, section 9.2): what goes over the wire, and for how long."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from typing import Any

from anyio import CapacityLimiter
from fastapi.sse import EventSourceResponse, format_sse_event
from starlette.types import Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceBusyError

HEARTBEAT = format_sse_event(comment="still here")
RETRY_AFTER = 5
MAX_MAKERS = 1


def encode_event(kind: str, data: Any, event_id: int | None = None) -> bytes:
    """An event as it is sent.

    Args:
        kind: Its name, which a browser calls the event's type.
        data: Plain values for JSON; numbers are finite.
        event_id: With which a client may come back for the rest; None leaves the one before.
    """
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    told = None if event_id is None else str(event_id)
    return format_sse_event(event=kind, data_str=text, id=told)


class EventSlots:
    """How many streams of events are open; used by the event loop alone.

    Args:
        limit: How many may be.

    Attributes:
        num_open: How many are.
        makers: Threads that make what they tell, where that takes long.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self.num_open = 0
        # Few, and none of those that answer requests, which would have to wait for them.
        self.makers = CapacityLimiter(MAX_MAKERS)

    def check(self) -> None:
        """Refuses one more.

        Raises:
            ServiceBusyError: If there are too many.
        """
        if self.num_open >= self._limit:
            busy_with = "streams of events are open already"
            raise ServiceBusyError(self.num_open, RETRY_AFTER, busy_with)


class EventStream(EventSourceResponse):
    """An answer that lasts as long as its events, or until its client has gone.

    FastAPI can do more where a route yields its events, but then fills silence every 15 s,
    whatever the settings say, and has no way to answer 204 to who has seen the end.

    Args:
        pieces: The encoded events.
        slots: Where it counts as open meanwhile.
    """

    def __init__(self, pieces: AsyncIterator[bytes], slots: EventSlots) -> None:
        # A proxy that gathers the answer first would make it useless.
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(pieces, headers=headers)
        self._slots = slots

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Sends the events; cancelled once the client has gone."""
        self._slots.num_open += 1
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._slots.num_open -= 1
