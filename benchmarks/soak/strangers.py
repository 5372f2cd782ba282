"""Clients that send invalid requests, send slowly, or send nothing."""

from __future__ import annotations

import json
import random
import selectors
import socket
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from benchmarks.soak.asking import Address, Asker, Tally

JSON = {"Content-Type": "application/json"}
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
QUERIES = ("tga=x", "sort=slip_path", "limit=-1", "limit=1e9", "metric=held", "created_from=no")
FOREIGN_HOSTS = ("evil.example", "evil.example:8020", "", "localhost.evil.example", "[::1")
FOREIGN_ORIGINS = ("http://evil.example", "null", "http://localhost.evil.example")
UPLOADS = (b"", b"\x89", b"\x89MCAP0\r\n", bytes(5000), b"PK\x03\x04" + bytes(500))
HUGE_STUDY = {
    "base": "paper-case-1",
    "vary": {
        key: {"min": 0.5, "max": 1.5, "count": 10_000}
        for key in ("object.mass", "fingers.0.friction", "fingers.1.friction")
    },
}


class Prankster:
    """Sends all listed invalid requests, in a seeded order.

    Args:
        address: Address of the service.
        tally: Counts every response.
        seed: Seed of the requests.
    """

    def __init__(self, address: Address, tally: Tally, seed: int) -> None:
        self._address = address
        self._tally = tally
        self._asker = Asker(address, tally)
        self._source = random.Random(seed)
        self._pranks: tuple[Callable[[], None], ...] = (
            self._send_unreadable,
            self._send_misshapen,
            self._ask_for_odd_ids,
            self._search_oddly,
            self._call_by_another_name,
            self._come_from_elsewhere,
            self._send_another_type,
            self._send_too_much,
            self._use_other_methods,
            self._upload_junk,
            self._ask_for_too_large_a_study,
            self._leave_midway,
        )

    def act(self) -> None:
        """Sends an invalid request."""
        self._source.choice(self._pranks)()

    def tidy_up(self) -> None:
        """Closes the connection."""
        self._asker.close()

    def _post(
        self, kind: str, path: str, expected: tuple[int, ...], body: Any, **headers: str
    ) -> None:
        content = body if isinstance(body, bytes) else json.dumps(body).encode()
        self._asker.ask(kind, "POST", path, expected, content, JSON | headers)

    def _send_unreadable(self) -> None:
        path = self._source.choice(["/runs", "/studies", "/studies/estimate"])
        self._post("unreadable", path, (400,), self._source.choice(UNREADABLE))

    def _send_misshapen(self) -> None:
        self._post("misshapen", "/runs", (422,), self._source.choice(MISSHAPEN))

    def _ask_for_odd_ids(self) -> None:
        part = self._source.choice(["", "/signals", "/signals.csv", "/recording"])
        path = f"/runs/{self._source.choice(IDS)}{part}"
        self._asker.ask("odd id", "GET", path, (404, 422))

    def _search_oddly(self) -> None:
        path = f"/runs?{self._source.choice(QUERIES)}"
        self._asker.ask("odd search", "GET", path, (422,))

    def _call_by_another_name(self) -> None:
        host = self._source.choice(FOREIGN_HOSTS)
        self._asker.ask("foreign host", "GET", "/health", (400,), None, {"Host": host})

    def _come_from_elsewhere(self) -> None:
        origin = self._source.choice(FOREIGN_ORIGINS)
        self._post("foreign page", "/runs", (403,), {"scenario": "paper-case-1"}, Origin=origin)

    def _send_another_type(self) -> None:
        kind = self._source.choice(["text/plain", "application/x-www-form-urlencoded", "json"])
        headers = {"Content-Type": kind}
        self._asker.ask("another type", "POST", "/runs", (415,), b"{}", headers)

    def _send_too_much(self) -> None:
        self._post("too much", "/runs", (413,), HUGE)

    def _use_other_methods(self) -> None:
        method, path = self._source.choice(
            [("DELETE", "/runs"), ("POST", "/health"), ("PUT", "/runs/abcdefghijkl")]
        )
        self._asker.ask("another method", method, path, (405,))

    def _upload_junk(self) -> None:
        content = self._source.choice(UPLOADS)
        headers = {"Content-Type": "application/octet-stream"}
        self._asker.ask("junk uploaded", "POST", "/recordings", (422,), content, headers)

    def _ask_for_too_large_a_study(self) -> None:
        self._post("too large a study", "/studies", (422,), HUGE_STUDY)

    def _leave_midway(self) -> None:
        """Interrupts an upload, or does not wait for a response."""
        request = self._source.choice(
            (
                "POST /api/v1/recordings HTTP/1.1\r\nContent-Length: 1000000\r\n",
                "GET /api/v1/parameters HTTP/1.1\r\n",
                "GET / HTTP/1.1\r\n",
            )
        )
        with socket.create_connection(self._address) as connection:
            host = f"Host: {self._address[0]}:{self._address[1]}\r\n\r\n"
            connection.sendall((request + host).encode() + bytes(1000))
        self._tally.note("left midway", "left")


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
        address: Address of the service.
        tally: Counts how each connection ended.
        seed: Seed of the numbers of each kind.
    """

    def __init__(self, address: Address, tally: Tally, seed: int) -> None:
        self._address = address
        self._tally = tally
        self._source = random.Random(seed)
        self._open: dict[socket.socket, tuple[_Way, float]] = {}
        self._selector = selectors.DefaultSelector()
        head = f"POST /api/v1/runs HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n"
        slow = f"{head}Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{{"
        self._ways = (
            _Way("idle connection", b"", 15.0, b""),
            _Way("half a head", head.encode(), 15.0, b""),
            _Way("half a body", slow.encode(), 30.0, b"HTTP/1.1 408"),
        )

    def act(self) -> None:
        """Opens a connection, and checks which of the others were closed."""
        way = self._source.choice(self._ways)
        connection = socket.create_connection(self._address)
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
            way, since = self._open[connection]
            answer = connection.recv(1 << 16)
            self._tally.note(way.kind, "let go", time.monotonic() - since)
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
