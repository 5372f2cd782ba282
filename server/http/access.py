"""Who may talk to a port: only pages and programs that address it as this machine.

A foreign page in the user's browser can reach loopback ports, directly or by a name that
it lets point to 127.0.0.1. The ``Host`` header betrays the second, ``Origin`` the first.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

import websockets.asyncio.server
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from slipgrasp.server.http.errors import problem_response

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")

RESOURCE_CONTENT_POLICY = "default-src 'none'; frame-ancestors 'self'"
"""For everything that is not a page: nothing in it may run or load."""

_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}

_logger = logging.getLogger(__name__)
_listener_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why a request is refused.

    Attributes:
        status: HTTP status, 400 for a foreign ``Host`` and 403 for a foreign ``Origin``.
        detail: A sentence with the way out.
    """

    status: int
    detail: str


def check_access(hosts: Sequence[str], origins: Sequence[str], port: int) -> Rejection | None:
    """Decides whether a request addresses this machine, and comes from its own page.

    Args:
        hosts: Values of all ``Host`` headers.
        origins: Values of all ``Origin`` headers; programs send none.
        port: The port the request arrived at.

    Returns:
        None if the request is welcome.
    """
    allowed = _authorities(port)
    way_out = f"use {', '.join(f'http://{authority}' for authority in allowed)}"
    if len(hosts) != 1 or hosts[0].lower() not in allowed:
        return Rejection(400, f"The Host header does not name this server; {way_out}.")
    if origins and (len(origins) != 1 or origins[0] not in {f"http://{a}" for a in allowed}):
        return Rejection(403, f"The Origin header names a foreign page; {way_out}.")
    return None


def _authorities(port: int) -> tuple[str, ...]:
    named = tuple(f"{name}:{port}" for name in LOOPBACK_NAMES)
    # Browsers leave the default port out.
    return (*named, *LOOPBACK_NAMES) if port == 80 else named


class AccessGuard:
    """ASGI middleware: refuses foreign requests before any route or upgrade, adds safe headers."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; what is neither HTTP nor websocket passes."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        port = scope["server"][1]
        rejection = check_access(headers.getlist("host"), headers.getlist("origin"), port)
        if rejection is not None:
            _logger.warning("refused %s: %s", scope["type"], rejection.detail.partition(";")[0])
            await problem_response(rejection.status, rejection.detail)(scope, receive, send)
            return
        await self._app(scope, receive, _with_safe_headers(send))


def _with_safe_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("Content-Security-Policy", RESOURCE_CONTENT_POLICY)
            for name, value in _HEADERS.items():
                headers[name] = value
        await send(message)

    return send_with_headers


@contextmanager
def guarded_websocket_listeners() -> Iterator[None]:
    """Within it, servers opened by the ``websockets`` package check ``Host`` and ``Origin``.

    viser opens its port so, answers anyone there and takes no option to change that.

    Raises:
        RuntimeError: If no server was opened this way, so that nothing stays open unguarded.
    """
    opened: list[int] = []
    serve = websockets.asyncio.server.serve

    def guarded_serve(*arguments: Any, **options: Any) -> Any:
        opened.append(1)
        options["process_request"] = _guarded(options.get("process_request"))
        return serve(*arguments, **options)

    with _listener_lock:
        websockets.asyncio.server.serve = guarded_serve
        try:
            yield
        finally:
            websockets.asyncio.server.serve = serve
    if not opened:
        raise RuntimeError("viser opened its port in an unknown way; its access is not guarded")


def _guarded(process_request: Any) -> Any:
    async def guarded_request(connection: ServerConnection, request: Request) -> Response | None:
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        rejection = check_access(hosts, origins, connection.local_address[1])
        if rejection is not None:
            return connection.respond(HTTPStatus(rejection.status), f"{rejection.detail}\n")
        return None if process_request is None else process_request(connection, request)

    return guarded_request
