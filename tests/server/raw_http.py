"""Requests that no client library would send."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from dataclasses import dataclass

from tests.waiting import PATIENCE

KEY = "dGhlIHNhbXBsZSBub25jZQ=="


@dataclass(frozen=True, slots=True)
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes


def exchange(port: int, *pieces: bytes) -> Answer:
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
        try:
            for piece in pieces:
                connection.sendall(piece)
        except (BrokenPipeError, ConnectionResetError):
            pass  # The server has answered and closed before it read everything.
        return _read(connection)


def _read(connection: socket.socket) -> Answer:
    received = b""
    while b"\r\n\r\n" not in received:
        piece = connection.recv(65536)
        assert piece, f"closed without an answer after {received!r}"
        received += piece
    head, _, body = received.partition(b"\r\n\r\n")
    status_line, *lines = head.decode("latin-1").split("\r\n")
    headers = {name.lower(): value.strip() for name, _, value in (x.partition(":") for x in lines)}
    length = int(headers.get("content-length", 0))
    while len(body) < length and (piece := connection.recv(65536)):
        body += piece
    return Answer(int(status_line.split()[1]), headers, body)


def get(port: int, path: str, headers: Sequence[tuple[str, str]]) -> Answer:
    return exchange(port, _head("GET", path, headers))


def post(port: int, path: str, headers: Sequence[tuple[str, str]], body: bytes) -> Answer:
    length = ("Content-Length", str(len(body)))
    return exchange(port, _head("POST", path, [*headers, length]), body)


def upgrade(
    port: int, path: str, headers: Sequence[tuple[str, str]], protocol: str | None = None
) -> Answer:
    upgrading = [
        ("Connection", "Upgrade"),
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", KEY),
    ]
    if protocol is not None:
        upgrading.append(("Sec-WebSocket-Protocol", protocol))
    return exchange(port, _head("GET", path, [*headers, *upgrading]))


def _head(method: str, path: str, headers: Sequence[tuple[str, str]]) -> bytes:
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers)]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")
