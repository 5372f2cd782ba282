"""A limit on request bodies that holds while they arrive, not after."""

from __future__ import annotations

from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipgrasp.server.exceptions import BodyTooLargeError
from slipgrasp.server.http.errors import problem_response


class BodyLimit:
    """ASGI middleware: answers 413 to a body that is, or turns out to be, too large.

    Starlette's ``RequestBodyLimitMiddleware`` has one limit for all paths, asks the application
    before it looks at what is declared, and may answer in plain text and keep the connection.

    Args:
        app: The application behind it, which answers `BodyTooLargeError`.
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
            headers = {"Connection": "close"}
            await problem_response(413, str(error), headers=headers)(scope, receive, send)
            return
        await self._app(scope, _counted(receive, max_bytes), send)


def _counted(receive: Receive, max_bytes: int) -> Receive:
    received = 0

    async def receive_counted() -> Message:
        nonlocal received
        message = await receive()
        if message["type"] == "http.request":
            received += len(message.get("body", b""))
            if received > max_bytes:
                raise BodyTooLargeError(max_bytes)
        return message

    return receive_counted
