"""Limits of the waiting time and number of connections.

Connections that are idle or too slow are closed, so that their number is limited by the work in
progress. At the limit, the one that has waited longest is closed for a new one.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from slipgrasp.server.exceptions import RETRY_AFTER
from slipgrasp.server.http.errors import problem_response
from slipgrasp.server.peers import Connection

try:
    import resource
except ImportError:  # Windows has no such limit.
    resource = None

REQUEST_SECONDS = 10.0
KEEP_ALIVE_SECONDS = 5
STALL_SECONDS = 30.0
MAX_CONNECTIONS = 1000
DESCRIPTORS_KEPT = 128
DESCRIPTORS_EACH = 2
MAX_SHARE_OF_PEER = 0.5
BACKLOG = 100
"""Number of connections that are accepted at a time."""

_LOOPBACK = ("127.0.0.1", "::1")

_logger = logging.getLogger(__name__)


def connection_limit() -> int:
    """Largest number of connections: each may need a file or another connection too."""
    if resource is None:
        return MAX_CONNECTIONS
    descriptors, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if descriptors == resource.RLIM_INFINITY:
        return MAX_CONNECTIONS
    return max(min((descriptors - DESCRIPTORS_KEPT) // DESCRIPTORS_EACH, MAX_CONNECTIONS), 1)


class GuardedProtocol(H11Protocol):
    """A connection with time limits for sending a request and receiving the response.

    It is in the ``state`` of each request, and of the websocket it may become.
    """

    max_connections = connection_limit()

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._request_deadline: asyncio.TimerHandle | None = None
        self._stall_deadline: asyncio.TimerHandle | None = None
        self._is_refused = False

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Accepts a new connection, or rejects it if none can be closed for it."""
        super().connection_made(transport)
        ends = (transport.get_extra_info("sockname"), transport.get_extra_info("peername"))
        if all(ends):
            local, peer = ends
            self.app_state = {**self.app_state, "connection": Connection(local[:2], peer[:2])}
        if self._has_capacity():
            self._watch()
        else:
            self._refuse()

    def connection_lost(self, exc: Exception | None) -> None:
        """Removes the connection and its time limits."""
        self._cancel_deadlines()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Receives data; only a complete request head extends the time limit."""
        if self._is_refused:
            return
        super().data_received(data)
        self._watch()

    def on_response_complete(self) -> None:
        """Waits for the next request."""
        super().on_response_complete()
        self._watch()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Transfers the connection to its new protocol."""
        self._cancel_deadlines()
        super().handle_websocket_upgrade(event)

    def pause_writing(self) -> None:
        """Limits the time of a client that does not receive its response."""
        super().pause_writing()
        self._stall_deadline = self.loop.call_later(STALL_SECONDS, self.transport.abort)

    def resume_writing(self) -> None:
        """Continues the response."""
        super().resume_writing()
        if self._stall_deadline is not None:
            self._stall_deadline.cancel()
            self._stall_deadline = None

    @property
    def is_waiting(self) -> bool:
        """Whether no response is in progress, and no request head is complete."""
        return self.cycle is None or self.cycle.response_complete

    @property
    def waiting_since(self) -> float:
        """Time limit of its request; smaller values are earlier."""
        return self._request_deadline.when() if self._request_deadline else 0.0

    def _watch(self) -> None:
        """Starts the time limit for the next request."""
        if not self.is_waiting or self.transport.get_protocol() is not self:
            if self._request_deadline is not None:
                self._request_deadline.cancel()
                self._request_deadline = None
        elif self._request_deadline is None:
            self._request_deadline = self.loop.call_later(REQUEST_SECONDS, self.let_go)

    def let_go(self) -> None:
        """Closes the idle connection."""
        self.connections.discard(self)
        self.transport.close()

    def _cancel_deadlines(self) -> None:
        for deadline in (self._request_deadline, self._stall_deadline):
            if deadline is not None:
                deadline.cancel()
        self._request_deadline = self._stall_deadline = None

    def _has_capacity(self) -> bool:
        """Whether another connection, and another one of its peer, is accepted."""
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
            c for c in among if isinstance(c, GuardedProtocol) and c.is_waiting and c is not self
        ]
        if not waiting:
            return False
        _logger.warning("%d connections are open: an idle one is closed", len(among))
        min(waiting, key=lambda connection: connection.waiting_since).let_go()
        return True

    def _refuse(self) -> None:
        _logger.warning("refused a connection: %d are open", len(self.connections) - 1)
        self._is_refused = True
        detail = f"too many connections are open; try again in {RETRY_AFTER} s"
        self._end_with(503, detail, {"Retry-After": str(RETRY_AFTER)})
        self.let_go()

    def send_400_response(self, msg: str) -> None:
        """Responds to invalid HTTP, unless a response was sent, and closes the connection."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            self._end_with(400, msg)
        self.transport.close()

    def _end_with(self, status: int, detail: str, headers: Mapping[str, str] | None = None) -> None:
        """Sends the last response of the connection."""
        answer = problem_response(
            status, detail, headers={"Connection": "close", **(headers or {})}
        )
        for event in (
            h11.Response(status_code=answer.status_code, headers=answer.raw_headers),
            h11.Data(data=bytes(answer.body)),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")


def _peer_of(connection: Any) -> str:
    """The address of the other end; empty if unknown."""
    return connection.client[0] if connection.client else ""


def note_failed_accepts(loop: asyncio.AbstractEventLoop) -> None:
    """Logs on one line that no descriptors are left; asyncio tries again after a second.

    The handler is called for each waiting connection, with an irrelevant traceback.
    """

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if "accept" in context.get("message", "") and isinstance(context["exception"], OSError):
            _logger.error("no connection can be accepted: %s", context["exception"].strerror)
        else:
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)
