"""Access control of a port: checks of the host name, the origin and the sender of requests.

A foreign page in the user's browser can reach loopback ports directly, or by a host name that
resolves to 127.0.0.1. The headers ``Origin`` and ``Sec-Fetch-Site`` reveal the first, ``Host`` the
second. `slipgrasp.server.http.identity` then decides the rights of the sender.
"""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import websockets.asyncio.server
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request
from websockets.http11 import Response as WebsocketResponse

from slipgrasp.server.addresses import DOCS_PATH, SESSIONS_PATH
from slipgrasp.server.exceptions import printable
from slipgrasp.server.http.errors import problem_response
from slipgrasp.server.http.identity import Gate, bearer_tokens, link_token
from slipgrasp.server.http.safe_headers import RESOURCE_CONTENT_POLICY, SAFE_HEADERS
from slipgrasp.server.tokens import Right

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
PAGES = ("/", DOCS_PATH)
"""Pages that people open, also by links from other sites."""

RELAY_TOKEN = secrets.token_urlsafe(32)
"""The secret that this process sends to its own ports, which reject other senders."""

_MAX_LOGGED = 200
_LOOKING = ("GET", "HEAD", "OPTIONS")
_CHALLENGE = {"WWW-Authenticate": 'Bearer realm="slipgrasp"'}


def in_one_line(record: logging.LogRecord) -> bool:
    """A logging filter: an error's name and text replace its traceback."""
    if record.exc_info and record.exc_info[1] is not None:
        error = record.exc_info[1]
        words = printable(str(error), _MAX_LOGGED)
        record.msg = f"{record.getMessage()}: {type(error).__name__}: {words}"
        record.args, record.exc_info = (), None
    return True


_logger = logging.getLogger(__name__)
_listener_logger = logging.getLogger(f"{__name__}.listener")
_listener_logger.addFilter(in_one_line)
_listener_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Rejection:
    """Rejection of a request.

    Attributes:
        status: HTTP status: 400 for a foreign ``Host``, 403 for a foreign page and for requests
            that a read-only token does not allow, 401 for an unknown sender.
        detail: A sentence with a remedy.
    """

    status: int
    detail: str

    @property
    def answer(self) -> Response:
        """The response with the rejection."""
        headers = _CHALLENGE if self.status == 401 else None
        return problem_response(self.status, self.detail, headers=headers)


UNKNOWN = Rejection(
    401,
    "The sender of the request is unknown; open the link that the server printed at its start, or "
    "send its token as 'Authorization: Bearer TOKEN'. On Linux the user who started the server "
    "needs no token, unless it was started with --require-token, --host, --public-url or "
    "--root-path.",
)
READ_ONLY = Rejection(
    403, "This token is read-only; ask the person who started the server for the full token."
)

FOREIGN = Rejection(403, "The request comes from another site's page; open this address directly.")


def check_access(
    hosts: Sequence[str],
    origins: Sequence[str],
    port: int,
    names: Sequence[str] = (),
    public: Sequence[str] = (),
) -> Rejection | None:
    """Checks whether a request addresses this server, and comes from its own page.

    Args:
        hosts: Values of all ``Host`` headers.
        origins: Values of all ``Origin`` headers; programs send none.
        port: The port the request arrived at.
        names: Names of this machine in addition to loopback.
        public: Other URLs of its pages, such as ``https://grasp.example``.

    Returns:
        None if the request is accepted.
    """
    own = (
        *(f"http://{authority}" for authority in _authorities((*LOOPBACK_NAMES, *names), port)),
        *public,
    )
    way_out = f"use {', '.join(own)}"
    if len(hosts) != 1 or hosts[0].lower() not in {origin.partition("//")[2] for origin in own}:
        return Rejection(400, f"The Host header does not name this server; {way_out}.")
    if origins and (len(origins) != 1 or origins[0] not in own):
        return Rejection(403, f"The Origin header names a foreign page; {way_out}.")
    return None


def _authorities(names: Sequence[str], port: int) -> tuple[str, ...]:
    named = tuple(f"{name}:{port}" for name in names)
    # Browsers omit the default port.
    return (*named, *names) if port == 80 else named


def is_foreign(sites: Sequence[str]) -> bool:
    """Whether ``Sec-Fetch-Site`` names another site; old browsers and programs do not send it.

    Args:
        sites: Values of all such headers.
    """
    return any(site not in ("same-origin", "none") for site in sites)


class AccessGuard:
    """ASGI middleware that rejects foreign requests before routes and upgrades, and adds headers.

    ``state.right`` holds the sender's right.

    Args:
        app: The guarded application.
        gate: The rights of senders.
        names: Names of this machine in addition to loopback.
        public: Other URLs of its pages, such as ``https://grasp.example``.
    """

    def __init__(
        self,
        app: ASGIApp,
        gate: Gate,
        names: Sequence[str] = (),
        public: Sequence[str] = (),
    ) -> None:
        self._app = app
        self._gate = gate
        self._names = names
        self._public = public

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; protocols other than HTTP and websocket pass unchanged."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        decision = self._check_page(scope, headers) or self._check_sender(scope, headers)
        if isinstance(decision, Rejection):
            told, kind = decision.detail.partition(";")[0], {"kind": decision.status}
            _logger.warning(
                "refused %s with %d: %s", scope["type"], decision.status, told, extra=kind
            )
            decision = decision.answer
        app = self._app if decision is None else decision
        await app(scope, receive, _with_safe_headers(send))

    def _check_page(self, scope: Scope, headers: Headers) -> Rejection | None:
        """Checks that a request comes from one of our pages, or from no page."""
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        port = scope["server"][1]
        rejection = check_access(hosts, origins, port, self._names, self._public)
        if rejection or not is_foreign(headers.getlist("sec-fetch-site")):
            return rejection
        if _is_opening(scope, headers):
            return None
        return FOREIGN

    def _check_sender(self, scope: Scope, headers: Headers) -> Rejection | Response | None:
        """Checks the right of the sender; a link with a token gets a redirect."""
        path, port = scope["path"], scope["server"][1]
        if path in PAGES and scope.get("method") == "GET":
            query = scope["query_string"].decode("latin-1")
            if (token := link_token(query)) is not None:
                right = self._gate.tokens.right_of(token)
                answer = self._gate.lead_on(path, query, right, port, _may_be_linked(headers))
                return answer if right else UNKNOWN
        state = scope.setdefault("state", {})
        right = state["right"] = self._gate.right_of(headers, state.get("connection"), port)
        if right is Right.NOTHING:
            return UNKNOWN
        # The session checks the messages of its page.
        may_ask = scope.get("method", "GET") in _LOOKING or path.startswith(f"{SESSIONS_PATH}/")
        return None if right is Right.EVERYTHING or may_ask else READ_ONLY


def _may_be_linked(headers: Headers) -> bool:
    """Whether a link on another site's page may have been followed; not all browsers report it."""
    sites = headers.getlist("sec-fetch-site")
    return is_foreign(sites) or (not sites and "text/html" in headers.get("accept", ""))


def _is_opening(scope: Scope, headers: Headers) -> bool:
    """Whether the request follows a link to one of our pages."""
    told = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest"))
    is_reading = scope.get("method") in ("GET", "HEAD")
    return is_reading and scope["path"] in PAGES and told == ("navigate", "document")


def _with_safe_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers.setdefault("Content-Security-Policy", RESOURCE_CONTENT_POLICY)
            for name, value in SAFE_HEADERS.items():
                headers[name] = value
        await send(message)

    return send_with_headers


@contextmanager
def guarded_websocket_listeners() -> Iterator[None]:
    """Admits only this process to ports that ``websockets`` opens inside the block.

    viser opens its port in this way, accepts all connections there, and has no option to change
    that. Errors there are logged on one line, because most are caused by clients.

    Raises:
        RuntimeError: If no server was opened this way, so that no port stays unguarded.
    """
    opened: list[int] = []
    serve = websockets.asyncio.server.serve

    def guarded_serve(*arguments: Any, **options: Any) -> Any:
        opened.append(1)
        options["process_request"] = _guarded(options.get("process_request"))
        options["logger"] = _listener_logger
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
    async def guarded_request(
        connection: ServerConnection, request: Request
    ) -> WebsocketResponse | None:
        rejection = _check_listener(connection, request)
        if rejection is None:
            return None if process_request is None else process_request(connection, request)
        problem = rejection.answer
        response = connection.respond(problem.status_code, bytes(problem.body).decode())
        del response.headers["Content-Type"], response.headers["Content-Length"]
        response.headers.update(problem.headers.items())
        return response

    return guarded_request


def _check_listener(connection: ServerConnection, request: Request) -> Rejection | None:
    """The rejection of a request to a ``websockets`` port; None if this process sent it."""
    headers = request.headers
    port = connection.local_address[1]
    rejection = check_access(headers.get_all("Host"), headers.get_all("Origin"), port)
    if rejection is not None:
        return rejection
    if is_foreign(headers.get_all("Sec-Fetch-Site")):
        return FOREIGN
    shown = bearer_tokens(headers.get_all("Authorization"))
    is_relay = any(secrets.compare_digest(t.encode(), RELAY_TOKEN.encode()) for t in shown)
    return None if is_relay else UNKNOWN
