"""Server-sent events (WHATWG HTML, section 9.2): what goes over the wire, and for how long."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Annotated, Any

from anyio import CapacityLimiter
from fastapi import Header
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from slipgrasp.server.exceptions import ServiceBusyError

HEARTBEAT = b": still here\n\n"
RETRY_AFTER = 5
MAX_MAKERS = 1

LastEventId = Annotated[
    str,
    Header(
        alias="Last-Event-ID",
        pattern=r"^[0-9]{0,12}$",
        description="id of the last event that was received; only what is new is sent",
        examples=["120"],
    ),
]
"""The header of that name; empty where there is none."""


@dataclass(frozen=True, slots=True)
class Event:
    """One event.

    Attributes:
        kind: Its name, which a browser calls the event's type.
        data: Plain values for JSON; numbers are finite.
        id: With which a client may come back for the rest; None leaves the one before.
    """

    kind: str
    data: Any
    id: int | None = None

    def encode(self) -> bytes:
        """The event as it is sent."""
        lines = [f"event: {self.kind}"]
        if self.id is not None:
            lines.append(f"id: {self.id}")
        text = json.dumps(self.data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        lines.append(f"data: {text}")
        return ("\n".join(lines) + "\n\n").encode()


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


class EventStream(StreamingResponse):
    """An answer that lasts as long as its events, or until its client has gone.

    Args:
        pieces: The encoded events.
        slots: Where it counts as open meanwhile.
    """

    media_type = "text/event-stream"

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
