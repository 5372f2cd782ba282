"""Limits of the size and slowness of request bodies, enforced while they arrive."""

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
    """ASGI middleware: responds with 413 to a body that is too large, and 408 to a slow one.

    Starlette's ``RequestBodyLimitMiddleware`` has one limit for all paths, calls the application
    before it checks the declared size, and may respond in plain text and keep the connection.

    Args:
        app: The application, which handles `BodyTooLargeError` and `BodyTooSlowError`.
        max_bytes: Largest body.
        larger: Larger limits by path.
    """

    def __init__(
        self, app: ASGIApp, max_bytes: int, larger: Mapping[str, int] | None = None
    ) -> None:
        self._app = app
        self._max_bytes = max_bytes
        self._larger = larger or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; protocols other than HTTP pass unchanged."""
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
    """An arriving body, monitored until it is complete or the response starts."""

    def __init__(self, receive: Receive, send: Send, max_bytes: int) -> None:
        self._receive = receive
        self._send = send
        self._max_bytes = max_bytes
        self._received = 0
        self._due = time.monotonic() + GRACE_SECONDS
        self._is_watched = True

    async def send(self, message: Message) -> None:
        """Passes the response on; the rest of the body is then discarded."""
        self._is_watched = False
        await self._send(message)

    async def receive(self) -> Message:
        """Passes the body on in pieces.

        Raises:
            BodyTooLargeError: If it is too large.
            BodyTooSlowError: If it arrives too slowly.
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
