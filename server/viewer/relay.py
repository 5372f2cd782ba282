"""The page and websocket of viser on the port of the application.

The page opens its websocket at its own address, so that one path serves both. Messages from viewers
are forwarded to viser's internal port, and back.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable
from contextlib import suppress

import msgspec
import websockets.asyncio.client
from fastapi import FastAPI, HTTPException, Request
from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from slipgrasp.server.http.access import RELAY_TOKEN
from slipgrasp.server.http.page_file import PageFile
from slipgrasp.server.tokens import Right
from slipgrasp.server.viewer.client_page import (
    PackingError,
    packed_page,
    unpack_page,
    with_end_of_head,
    with_head,
)
from slipgrasp.server.viewer.pace import Pace
from slipgrasp.server.viewer.probation import Probation

MAX_VIEWERS = 64
CLOSE_SECONDS = 1
FULL_SECONDS = 3.0
LOOK_SECONDS = 0.05
"""Smallest interval between forwarded camera positions of a viewer."""

CONTENT_POLICY = "; ".join(
    (
        "default-src 'none'",
        # A WebAssembly module of its script generates its bindings from strings.
        "script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:",
        "worker-src blob: data:",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src data:",
        "media-src data: blob:",
        "connect-src 'self' data: blob:",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'self'",
    )
)
"""Content policy of viser's page: it may execute its own content, and connect to its origin."""

_FILES = "viser"  # folder of the scripts and styles of the page, below its path
# Names are relative: the page does not know its path behind a proxy.
_LOADER = f"""<link rel="modulepreload" href="{_FILES}/viser.js" />
<link rel="stylesheet" href="{_FILES}/viser.css" />
<script type="module">
globalThis.__viserZstdWasm = await WebAssembly.compileStreaming(fetch("{_FILES}/decoder.wasm"));
await import("./{_FILES}/viser.js");
</script>"""
_LOOKING = ("ViewerCameraMessage",)
_PROTOCOL_PREFIX = "viser-v"
_GOING_AWAY, _UNSUPPORTED_DATA, _POLICY_VIOLATION, _TRY_AGAIN_LATER = 1001, 1003, 1008, 1013
_FAULTY_CODES = (1002, 1007, 1009)
"""Close codes of the relay for protocol violations and for messages that are too long."""
_UNSENDABLE_CODES = (1004, 1005, 1006, 1015)

_logger = logging.getLogger(__name__)

FindFault = Callable[[bytes], str]


def _find_none(_message: bytes) -> str:
    return ""


def add_viewer_routes(
    app: FastAPI,
    upstream_port: Callable[[], int],
    head: str = "",
    find_faults: Callable[[], FindFault] = lambda: _find_none,
) -> ViewerRelay:
    """Serves viser's page and websocket at the root of an application.

    Args:
        app: The application.
        upstream_port: Returns viser's internal port, called once per viewer.
        head: HTML inserted at the start of the head of the page.
        find_faults: Returns, for each viewer, a function that describes why a message is invalid;
            by default all are valid.

    Returns:
        The relay, which reports whether it can serve another viewer.

    Raises:
        RuntimeError: If viser's page has no suitable head.
    """
    relay = ViewerRelay(upstream_port, head, find_faults)
    app.add_api_websocket_route("/", relay.connect)
    for place, show in (("/", relay.show_page), (f"/{_FILES}/{{name}}", relay.show_file)):
        app.add_api_route(place, show, methods=["GET"], include_in_schema=False)
    return relay


class ViewerRelay:
    """Serves the page, and relays messages between viewers and viser.

    Args:
        upstream_port: Returns viser's internal port.
        head: HTML inserted at the start of the head of the page.
        find_faults: Returns, for each viewer, a function that describes why a message is invalid.

    Raises:
        RuntimeError: If viser's page has no suitable head.
    """

    def __init__(
        self,
        upstream_port: Callable[[], int],
        head: str = "",
        find_faults: Callable[[], FindFault] = lambda: _find_none,
    ) -> None:
        self._upstream_port = upstream_port
        self._find_faults = find_faults
        page, self._files = _files_of(packed_page())
        policy = {"Content-Security-Policy": CONTENT_POLICY}
        self._page = PageFile(with_head(page, head), "text/html", policy)
        self._probation = Probation()
        self._num_viewers = 0
        self._turned_away_at = -math.inf

    @property
    def is_full(self) -> bool:
        """Whether a viewer has just been rejected because there are too many."""
        return time.monotonic() - self._turned_away_at < FULL_SECONDS

    def show_page(self, request: Request) -> Response:
        """Returns the page."""
        return self._page.answer(request)

    def show_file(self, name: str, request: Request) -> Response:
        """Returns a script or style of the page."""
        found = self._files.get(name)
        if found is None:
            raise HTTPException(404, "there is no such file")
        return found.answer(request)

    async def connect(self, viewer: WebSocket) -> None:
        """Relays one viewer until either side disconnects."""
        if self._num_viewers >= MAX_VIEWERS:
            self._turned_away_at = time.monotonic()
            await _turn_away(viewer, f"{MAX_VIEWERS} viewers are connected already")
            return
        self._num_viewers += 1
        try:
            await self._relay(viewer)
        finally:
            self._num_viewers -= 1

    async def _relay(self, viewer: WebSocket) -> None:
        offered = _viser_protocols(viewer)
        await viewer.accept(subprotocol=offered[0] if offered else None)
        peer = viewer.client.host if viewer.client else ""
        await self._probation.wait(peer)
        try:
            upstream = await websockets.asyncio.client.connect(
                f"ws://127.0.0.1:{self._upstream_port()}",
                subprotocols=offered or None,
                additional_headers={"Authorization": f"Bearer {RELAY_TOKEN}"},
                compression=None,
                max_size=None,
                ping_interval=None,
                proxy=None,
            )
        except (OSError, TimeoutError, InvalidHandshake) as error:
            _logger.error("viser does not answer: %s", error)
            await viewer.close(_TRY_AGAIN_LATER, "the viewer is not ready")
            return
        try:
            if await _exchange(viewer, upstream, self._find_faults()):
                self._probation.note_fault(peer)
        finally:
            await _hang_up(upstream)


def _files_of(packed: bytes) -> tuple[bytes, dict[str, PageFile]]:
    """The page, and by name the files that it loads; none if viser packs it in another way."""
    try:
        page, style, code, decoder = unpack_page(packed)
    except PackingError:
        return packed, {}
    files = {
        "viser.css": PageFile(style, "text/css"),
        "viser.js": PageFile(code, "text/javascript"),
        "decoder.wasm": PageFile(decoder, "application/wasm"),
    }
    return with_end_of_head(page, _LOADER), files


async def _exchange(viewer: WebSocket, upstream: ClientConnection, find_fault: FindFault) -> bool:
    """Relays messages until either side disconnects; returns whether the viewer misbehaved."""
    looks = _Looks(upstream)
    tasks = [
        asyncio.create_task(_pass_up(viewer, upstream, find_fault, looks)),
        asyncio.create_task(looks.pass_up()),
        asyncio.create_task(_pass_down(viewer, upstream)),
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        was_at_fault, *_ = await asyncio.gather(*tasks, return_exceptions=True)
    return was_at_fault is True


async def _hang_up(upstream: ClientConnection) -> None:
    """Closes without waiting for undelivered messages."""
    try:
        async with asyncio.timeout(CLOSE_SECONDS):
            await upstream.close()
    except TimeoutError:
        upstream.transport.abort()


class _Looks:
    """Sends the latest camera of a viewer to viser, at a limited rate."""

    def __init__(self, upstream: ClientConnection) -> None:
        self._upstream = upstream
        self._latest = b""
        self._has_moved = asyncio.Event()

    def take(self, content: bytes) -> None:
        """Accepts a message, which replaces an unsent one."""
        self._latest = content
        self._has_moved.set()

    async def pass_up(self) -> None:
        """Sends messages until the connection is closed."""
        with suppress(ConnectionClosed):
            while await self._has_moved.wait():
                self._has_moved.clear()
                await self._upstream.send(self._latest)
                await asyncio.sleep(LOOK_SECONDS)


async def _pass_up(
    viewer: WebSocket, upstream: ClientConnection, find_fault: FindFault, looks: _Looks
) -> bool:
    """Relays valid messages of a viewer at a limited rate; viser accepts bytes only.

    Returns:
        Whether the viewer has sent an invalid message.
    """
    pace = Pace()
    while True:
        message = await viewer.receive()
        if message["type"] == "websocket.disconnect":
            return message.get("code") in _FAULTY_CODES
        content = message.get("bytes")
        if content is None:
            await viewer.close(_UNSUPPORTED_DATA, "binary messages only")
            return True
        if fault := find_fault(content):
            _logger.warning("closed a viewer: %s", fault)
            await viewer.close(_POLICY_VIOLATION, fault)
            return True
        await asyncio.sleep(pace.count(len(content)))
        if _only_looks(content):
            looks.take(content)
        elif viewer.state.right >= Right.EVERYTHING:
            try:
                await upstream.send(content)
            except ConnectionClosed:
                return False


class _Kind(msgspec.Struct):
    """The type of a message of viser."""

    type: str


_kind_of = msgspec.msgpack.Decoder(_Kind)


def _only_looks(content: bytes) -> bool:
    """Whether a message has the camera of a viewer, without which viser shows nothing."""
    try:
        return _kind_of.decode(content).type in _LOOKING
    except msgspec.DecodeError:
        return False


async def _pass_down(viewer: WebSocket, upstream: ClientConnection) -> None:
    """Relays viser's messages, waiting for slow viewers, and finally its close reason."""
    try:
        async for message in upstream:
            await viewer.send_bytes(message if isinstance(message, bytes) else message.encode())
        await _close(viewer, upstream.close_code, upstream.close_reason)
    except ConnectionClosed:
        await _close(viewer, upstream.close_code, upstream.close_reason)
    except WebSocketDisconnect:
        return


async def _close(viewer: WebSocket, code: int | None, reason: str | None) -> None:
    sendable = code is not None and code not in _UNSENDABLE_CODES
    await viewer.close(code if sendable and code else _GOING_AWAY, reason or "")


async def _turn_away(viewer: WebSocket, reason: str) -> None:
    """Accepts, so that the page receives the reason, and closes."""
    offered = _viser_protocols(viewer)
    await viewer.accept(subprotocol=offered[0] if offered else None)
    await viewer.close(_TRY_AGAIN_LATER, reason)


def _viser_protocols(viewer: WebSocket) -> list[Subprotocol]:
    offered: list[str] = viewer.scope["subprotocols"]
    return [Subprotocol(name) for name in offered if name.startswith(_PROTOCOL_PREFIX)]
