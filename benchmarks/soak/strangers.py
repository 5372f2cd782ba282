"""Clients that send invalid requests, send slowly, or send nothing."""

from __future__ import annotations

import json
import random
import selectors
import socket
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from benchmarks.faults.clients import slow_request
from benchmarks.soak.asking import Tally

JSON = {"Content-Type": "application/json"}
BINARY = {"Content-Type": "application/octet-stream"}
DEEP = b"[" * 100_000
HUGE = b" " * 1_100_000
UNREADABLE = (b"", b"{", b"\0", b"\xef\xbb\xbf{}", b'{"scenario": "paper\xff"}', DEEP, b"'a'")
MISSHAPEN: tuple[Any, ...] = (
    [],
    None,
    1,
    "paper-case-1",
    {},
    {"scenario": 1},
    {"scenario": {}},
    {"scenario": "../paper-case-1"},
    {"scenario": "/etc/passwd"},
    {"scenario": "paper-case-1", "sett": {}},
    {"scenario": "paper-case-1", "set": {"masss": 1}},
    {"scenario": "paper-case-1", "set": {"object.mass": float("nan")}},
    {"scenario": "paper-case-1", "set": {"object.mass": "1"}},
    {"scenario": "paper-case-1", "set": {"object.mass": -1, "fingers.0.friction": True}},
    {"scenario": "paper-case-1", "set": {"simulation.duration": 1e9}},
    {"scenario": "paper-case-1", "set": {f"a{i}": i for i in range(2000)}},
    {"scenario": "paper-case-1", "set": {"title": "\x00"}},
)
IDS = ("..", "%2e%2e", "..%2f..%2fetc%2fpasswd", "%00", "a" * 300, "CON", "abcdefghijkl", "%ff%fe")
PARTS = ("", "/signals", "/signals.csv", "/recording")
QUERIES = ("tga=x", "sort=slip_path", "limit=-1", "limit=1e9", "metric=held", "created_from=no")
FOREIGN_HOSTS = ("evil.example", "evil.example:8020", "", "localhost.evil.example", "[::1")
FOREIGN_ORIGINS = ("http://evil.example", "null", "http://localhost.evil.example")
FROM_ELSEWHERE = [JSON | {"Origin": origin} for origin in FOREIGN_ORIGINS]
OTHER_TYPES = ("text/plain", "application/x-www-form-urlencoded", "json")
OTHER_METHODS = ("DELETE /runs", "POST /health", "PUT /runs/abcdefghijkl")
UPLOADS = (b"", b"\x89", b"\x89MCAP0\r\n", bytes(5000), b"PK\x03\x04" + bytes(500))
_MANY = {"min": 0.5, "max": 1.5, "count": 10_000}
_VARIED = dict.fromkeys(("object.mass", "fingers.0.friction", "fingers.1.friction"), _MANY)
HUGE_STUDY = json.dumps({"base": "paper-case-1", "vary": _VARIED}).encode()


class Prank(NamedTuple):
    """Invalid requests of one kind, of which one of each sequence is drawn.

    Attributes:
        kind: Its name.
        expected: Allowed statuses.
        requests: Methods and paths.
        bodies: Bodies.
        headers: Headers.
    """

    kind: str
    expected: tuple[int, ...]
    requests: Sequence[str]
    bodies: Sequence[bytes | None] = (None,)
    headers: Sequence[dict[str, str]] = ({},)


_RUN = ("POST /runs",)
_RUN_BODY = b'{"scenario": "paper-case-1"}'
_STUDIES = ("POST /runs", "POST /studies", "POST /studies/estimate")
PRANKS = (
    Prank("unreadable", (400,), _STUDIES, UNREADABLE, (JSON,)),
    Prank("misshapen", (422,), _RUN, [json.dumps(body).encode() for body in MISSHAPEN], (JSON,)),
    Prank("odd id", (404, 422), [f"GET /runs/{name}{part}" for name in IDS for part in PARTS]),
    Prank("odd search", (422,), [f"GET /runs?{query}" for query in QUERIES]),
    Prank("foreign host", (400,), ("GET /health",), (None,), [{"Host": h} for h in FOREIGN_HOSTS]),
    Prank("foreign page", (403,), _RUN, (_RUN_BODY,), FROM_ELSEWHERE),
    Prank("another type", (415,), _RUN, (b"{}",), [{"Content-Type": kind} for kind in OTHER_TYPES]),
    Prank("too much", (413,), _RUN, (HUGE,), (JSON,)),
    Prank("another method", (405,), OTHER_METHODS),
    Prank("junk uploaded", (422,), ("POST /recordings",), UPLOADS, (BINARY,)),
    Prank("too large a study", (422,), ("POST /studies",), (HUGE_STUDY,), (JSON,)),
)
ABANDONED = (
    "POST /api/v1/recordings HTTP/1.1\r\nContent-Length: 1000000\r\n",
    "GET /api/v1/parameters HTTP/1.1\r\n",
    "GET / HTTP/1.1\r\n",
)


def play_prank(tally: Tally, source: random.Random) -> None:
    """Sends an invalid request.

    Args:
        tally: Sends and counts it.
        source: Source of random numbers.
    """
    prank = source.choice((*PRANKS, None))
    if prank is None:
        _leave_midway(tally, source.choice(ABANDONED))
        return
    method, _, path = source.choice(prank.requests).partition(" ")
    body, headers = source.choice(prank.bodies), source.choice(prank.headers)
    tally.ask(prank.kind, method, path, prank.expected, body, headers)


def _leave_midway(tally: Tally, request: str) -> None:
    """Interrupts an upload, or does not wait for a response."""
    host, port = tally.address
    with socket.create_connection((host, port)) as connection:
        connection.sendall(f"{request}Host: {host}:{port}\r\n\r\n".encode() + bytes(1000))
    tally.note("left midway", "left")


class _Way(NamedTuple):
    """A client that keeps the server waiting.

    Attributes:
        kind: Its name.
        sent: All sent bytes.
        seconds: Longest time that the server may wait [s].
        answer: Start of the response; empty for no response.
    """

    kind: str
    sent: bytes
    seconds: float
    answer: bytes


class Loiterer:
    """Opens connections that send nothing, or never finish, and waits until they are closed.

    Args:
        tally: Counts how each connection ended.
        seed: Seed of the numbers of each kind.
    """

    def __init__(self, tally: Tally, seed: int) -> None:
        self._tally = tally
        self._source = random.Random(seed)
        self._open: dict[socket.socket, tuple[_Way, float]] = {}
        self._selector = selectors.DefaultSelector()
        slow = slow_request(tally.address)
        self._ways = (
            _Way("idle connection", b"", 15.0, b""),
            _Way("half a head", slow[:80], 15.0, b""),
            _Way("half a body", slow, 30.0, b"HTTP/1.1 408"),
        )

    def act(self) -> None:
        """Opens a connection, and checks which of the others were closed."""
        way = self._source.choice(self._ways)
        connection = socket.create_connection(self._tally.address)
        connection.sendall(way.sent)
        connection.setblocking(False)
        self._selector.register(connection, selectors.EVENT_READ)
        self._open[connection] = way, time.monotonic()
        self._see_who_was_let_go()

    def tidy_up(self) -> None:
        """Closes all connections."""
        for connection in list(self._open):
            self._forget(connection)

    def _see_who_was_let_go(self) -> None:
        for key, _ in self._selector.select(0.0):
            connection = key.fileobj
            assert isinstance(connection, socket.socket)
            way, _ = self._open[connection]
            answer = connection.recv(1 << 16)
            self._tally.note(way.kind, "let go")
            fits = answer.startswith(way.answer) if way.answer else not answer
            self._tally.expect(way.kind, fits, f"{answer[:200]!r}")
            self._forget(connection)
        for connection, (way, since) in list(self._open.items()):
            if time.monotonic() - since > way.seconds:
                self._tally.blame(way.kind, f"still open after {way.seconds:g} s")
                self._forget(connection)

    def _forget(self, connection: socket.socket) -> None:
        del self._open[connection]
        self._selector.unregister(connection)
        connection.close()
