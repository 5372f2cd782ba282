"""Limits on size and slowness of request bodies that hold while they arrive, not after."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipgrasp.server.exceptions import BodyTooLargeError, BodyTooSlowError
from slipgrasp.server.http.errors import problem_response

GRACE_SECONDS = 20.0
SLOWEST_BYTES_PER_SECOND = 10_000.0


class BodyLimit:
    """ASGI middleware: answers 413 to a body that is, or turns out to be, too large, 408 if slow.

    Starlette's ``RequestBodyLimitMiddleware`` has one limit for all paths, asks the application
    before it looks at what is declared, and may answer in plain text and keep the connection.

    Args:
        app: The application behind it, which answers `BodyTooLargeError` and `BodyTooSlowError`.
        max_bytes: Largest body.
        larger: Paths to which a larger one may be sent, and how large.
    """

    def __init__(
        self, app: ASGIApp, max_bytes: int, larger: Mapping[str, int] | None = None
    ) -> None:
        self._app = app
        self._max_bytes = max_bytes
        self._larger = larger or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; what is not HTTP passes."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        max_bytes = self._larger.get(scope["path"], self._max_bytes)
        declared = Headers(scope=scope).get("content-length", "0")
        if not declared.isdecimal() or int(declared) > max_bytes:
            error = BodyTooLargeError(max_bytes)
            await problem_response(413, str(error))(scope, receive, send)
            return
        body = _Body(receive, send, max_bytes)
        await self._app(scope, body.receive, body.send)


class _Body:
    """A body on its way, watched until it is whole or somebody answers without it."""

    def __init__(self, receive: Receive, send: Send, max_bytes: int) -> None:
        self._receive = receive
        self._send = send
        self._max_bytes = max_bytes
        self._received = 0
        self._due = time.monotonic() + GRACE_SECONDS
        self._is_watched = True

    async def send(self, message: Message) -> None:
        """Passes the answer on; what of the body is then still to come is only thrown away."""
        self._is_watched = False
        await self._send(message)

    async def receive(self) -> Message:
        """Passes the body on, piece by piece.

        Raises:
            BodyTooLargeError: If it is.
            BodyTooSlowError: If it hardly arrives.
        """
        if not self._is_watched:
            return await self._receive()
        due = self._due + self._received / SLOWEST_BYTES_PER_SECOND
        try:
            async with asyncio.timeout(due - time.monotonic()):
                message = await self._receive()
        except TimeoutError:
            raise BodyTooSlowError from None
        self._received += len(message.get("body", b""))
        if self._received > self._max_bytes:
            raise BodyTooLargeError(self._max_bytes)
        self._is_watched = message.get("more_body", False)
        return message
