"""A viewer without a browser: it implements viser's protocol, and reads the messages for a page."""

from __future__ import annotations

import json
import re
import urllib.request
from collections.abc import Callable, Iterator
from html import unescape
from typing import Any, Self

import msgspec
import viser
import zstandard
from websockets.sync.client import connect
from websockets.typing import Subprotocol

_WIDTH, _HEIGHT = 1440, 900
_HEADER_BYTES = 16
PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
_PATIENCE = 60.0
_SESSION_STATE = re.compile(r'data-sg-state="([^"]*)"')


class HeadlessViewer:
    """One connected viewer.

    Args:
        url: Address of its websocket.

    Attributes:
        bytes_received: Number of bytes received so far.
    """

    def __init__(self, url: str) -> None:
        # Unread messages would delay the response to its close request.
        self._socket = connect(
            url, subprotocols=[PROTOCOL], compression=None, max_size=None, close_timeout=0.5
        )
        self._page = url.replace("ws", "http", 1).rstrip("/")
        self._key = ""
        self.bytes_received = 0
        self.send("ViewerCameraMessage", camera_fields())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def post(self, **intent: object) -> None:
        """Sends the requests of the page's script, after the session has sent its key."""
        while not self._key:
            list(self.receive())
        request = urllib.request.Request(
            f"{self._page}/dashboard/sessions/{self._key}/intents",
            json.dumps([intent]).encode(),
            {"Content-Type": "application/json"},
        )
        urllib.request.urlopen(request, timeout=_PATIENCE).close()

    def wait_for(self, condition: Callable[[dict[str, Any]], bool], times: int = 1) -> None:
        """Reads messages until a number of them meet a condition.

        Raises:
            TimeoutError: If no message arrives for a minute.
        """
        while times > 0:
            times -= sum(condition(message) for message in self.receive())

    def receive(self) -> Iterator[dict[str, Any]]:
        """The messages of the next frame.

        Raises:
            TimeoutError: If none arrives for a minute.
        """
        content = self._socket.recv(timeout=_PATIENCE)
        assert isinstance(content, bytes)
        self.bytes_received += len(content)
        for message in messages_of(content):
            state = session_state(content_of(message))
            if state is not None:
                self._key = state["session"]
            yield message

    def send(self, kind: str, fields: dict[str, object]) -> None:
        """Sends a message."""
        self._socket.send(msgspec.msgpack.encode({"type": kind, **fields}))


def messages_of(content: bytes) -> list[dict[str, Any]]:
    """The messages of a frame of the websocket."""
    size = int.from_bytes(content[8:_HEADER_BYTES], "little")
    packed = zstandard.ZstdDecompressor().decompress(content[_HEADER_BYTES : _HEADER_BYTES + size])
    return msgspec.msgpack.decode(packed)["messages"]


def content_of(message: dict[str, Any]) -> str:
    """The text that a message adds to the page."""
    content = message.get("updates", {}).get("content", "")
    return content if isinstance(content, str) else ""


def session_state(content: str) -> dict[str, Any] | None:
    """The state that a session sends to the page's script; None for other messages."""
    found = _SESSION_STATE.search(content)
    return None if found is None else json.loads(unescape(found[1]))


def camera_fields() -> dict[str, object]:
    """The camera message of a viewer when it connects."""
    return {
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (1.0, -6.0, 1.0),
        "fov": 0.4,
        "near": 0.01,
        "far": 1000.0,
        "image_height": _HEIGHT,
        "image_width": _WIDTH,
        "look_at": (1.0, 0.0, 1.0),
        "up_direction": (0.0, 0.0, 1.0),
    }
