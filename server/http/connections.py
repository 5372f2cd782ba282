"""Connections: how long each may keep the server waiting, and how many there may be.

Who has nothing to ask, or asks too slowly, is let go, so that what is open is bounded by what
is worked on. At the bound the one that has waited longest is closed for the next.
"""

from __future__ import annotations

import asyncio
import logging
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from slipgrasp.server.http.errors import problem_response

try:
    import resource
except ImportError:  # Windows, which has no such limit.
    resource = None

REQUEST_SECONDS = 10.0
KEEP_ALIVE_SECONDS = 5
STALL_SECONDS = 30.0
MAX_CONNECTIONS = 1000
DESCRIPTORS_KEPT = 128
DESCRIPTORS_EACH = 2
MAX_SHARE_OF_PEER = 0.5
RETRY_AFTER = 5
BACKLOG = 100
"""How many connections are accepted at a time, before any of them is looked at."""

_LOOPBACK = ("127.0.0.1", "::1")

_logger = logging.getLogger(__name__)


def connection_limit() -> int:
    """How many connections there may be: each may need a file or a second connection besides."""
    if resource is None:
        return MAX_CONNECTIONS
    descriptors, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if descriptors == resource.RLIM_INFINITY:
        return MAX_CONNECTIONS
    return max(min((descriptors - DESCRIPTORS_KEPT) // DESCRIPTORS_EACH, MAX_CONNECTIONS), 1)


class BoundedConnection(H11Protocol):
    """A connection with deadlines for a request and for taking the answer, one of so many."""

    max_connections = connection_limit()

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._request_deadline: asyncio.TimerHandle | None = None
        self._stall_deadline: asyncio.TimerHandle | None = None
        self._is_refused = False

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Takes a new connection on, or refuses it where none can be let go for it."""
        super().connection_made(transport)
        if self._has_capacity():
            self._watch()
        else:
            self._refuse()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forgets the connection and its deadlines."""
        self._cancel_deadlines()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Takes what comes; bytes alone put no deadline off, only a whole head does."""
        if self._is_refused:
            return
        super().data_received(data)
        self._watch()

    def on_response_complete(self) -> None:
        """Waits for the next request."""
        super().on_response_complete()
        self._watch()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Leaves the connection to its new protocol."""
        self._cancel_deadlines()
        super().handle_websocket_upgrade(event)

    def pause_writing(self) -> None:
        """Gives a client that takes nothing of its answer some time."""
        super().pause_writing()
        self._stall_deadline = self.loop.call_later(STALL_SECONDS, self.transport.abort)

    def resume_writing(self) -> None:
        """Goes on with the answer."""
        super().resume_writing()
        if self._stall_deadline is not None:
            self._stall_deadline.cancel()
            self._stall_deadline = None

    @property
    def is_waiting(self) -> bool:
        """Whether no request is being answered, nor the head of one complete."""
        return self.cycle is None or self.cycle.response_complete

    @property
    def waiting_since(self) -> float:
        """When it was to send a request by; less is longer ago."""
        return self._request_deadline.when() if self._request_deadline else 0.0

    def _watch(self) -> None:
        """Lets the deadline run for as long as a request is waited for."""
        if not self.is_waiting or self.transport.get_protocol() is not self:
            if self._request_deadline is not None:
                self._request_deadline.cancel()
                self._request_deadline = None
        elif self._request_deadline is None:
            self._request_deadline = self.loop.call_later(REQUEST_SECONDS, self.let_go)

    def let_go(self) -> None:
        """Closes the connection, which is owed nothing."""
        self.connections.discard(self)
        self.transport.close()

    def _cancel_deadlines(self) -> None:
        for deadline in (self._request_deadline, self._stall_deadline):
            if deadline is not None:
                deadline.cancel()
        self._request_deadline = self._stall_deadline = None

    def _has_capacity(self) -> bool:
        """Whether one more connection, and one more of its peer, is accepted."""
        peer = _peer_of(self)
        share = 1.0 if peer in _LOOPBACK else MAX_SHARE_OF_PEER
        same = [c for c in self.connections if _peer_of(c) == peer]
        if len(same) > share * self.max_connections:
            return self._let_longest_wait_go(same)
        if len(self.connections) > self.max_connections:
            return self._let_longest_wait_go(list(self.connections))
        return True

    def _let_longest_wait_go(self, among: list[Any]) -> bool:
        waiting = [
            c for c in among if isinstance(c, BoundedConnection) and c.is_waiting and c is not self
        ]
        if not waiting:
            return False
        _logger.warning("%d connections are open: one that asks for nothing is closed", len(among))
        min(waiting, key=lambda connection: connection.waiting_since).let_go()
        return True

    def _refuse(self) -> None:
        _logger.warning("refused a connection: %d are open", len(self.connections) - 1)
        self._is_refused = True
        detail = f"too many connections are open; try again in {RETRY_AFTER} s"
        headers = {"Retry-After": str(RETRY_AFTER), "Connection": "close"}
        answer = problem_response(503, detail, headers=headers)
        head = b"".join(name + b": " + value + b"\r\n" for name, value in answer.raw_headers)
        self.transport.write(b"HTTP/1.1 503 Service Unavailable\r\n" + head + b"\r\n")
        self.transport.write(bytes(answer.body))
        self.let_go()


def _peer_of(connection: Any) -> str:
    """The address at the other end; empty where there is none."""
    return connection.client[0] if connection.client else ""


def note_failed_accepts(loop: asyncio.AbstractEventLoop) -> None:
    """Says in one line that there are no descriptors left; asyncio goes on in a second by itself.

    It calls its handler for each connection that waits, with a traceback that tells nothing.
    """

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if "accept" in context.get("message", "") and isinstance(context["exception"], OSError):
            _logger.error("no connection can be accepted: %s", context["exception"].strerror)
        else:
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)
