"""A service in a separate process, and requests to it."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

API = "/api/v1"
POLL = 0.01
PATIENCE = 900.0

Address = tuple[str, int]
Body = bytes | Mapping[str, Any] | None


class Answer(NamedTuple):
    """Response to a request.

    Attributes:
        status: HTTP status.
        headers: Headers by lower-case name.
        content: The body, or its start.
    """

    status: int
    headers: dict[str, str]
    content: bytes

    @property
    def json(self) -> Any:
        """The body, decoded."""
        return json.loads(self.content)


class Service(NamedTuple):
    """A running service.

    Attributes:
        process: Its process.
        url: Its URL.
        log: Its log file.
    """

    process: subprocess.Popen[str]
    url: str
    log: Path

    @property
    def address(self) -> Address:
        """Host and port."""
        parts = urlsplit(self.url)
        assert parts.hostname is not None and parts.port is not None
        return parts.hostname, parts.port

    @property
    def socket(self) -> str:
        """URL of the dashboard's websocket."""
        return self.url.replace("http", "ws", 1)

    def exchange(
        self, path: str, body: Body = None, prefer: str = "", keep: int | None = None
    ) -> Answer:
        """The response to a GET, or to a POST of a body.

        Args:
            path: Path below ``/api/v1``.
            body: Body of a POST.
            prefer: Header of the same name.
            keep: Number of bytes of the response that are kept; all by default.
        """
        method, headers = "GET" if body is None else "POST", {"Prefer": prefer} if prefer else {}
        return exchange(self.address, method, path, body, headers, keep)

    def ask(self, path: str, body: Body = None, prefer: str = "") -> Any:
        """The decoded response.

        Raises:
            AssertionError: If it is an error.
        """
        answer = self.exchange(path, body, prefer)
        assert answer.status < 300, f"{path}: {answer.status} {answer.content[:500]!r}"
        return answer.json

    def seconds_of(self, path: str) -> float:
        """Response time of a GET [s]."""
        started = time.perf_counter()
        status = self.exchange(path, keep=0).status
        assert status < 300, f"{path}: {status}"
        return time.perf_counter() - started

    def run_after_end(self, run_id: str) -> dict[str, Any]:
        """A run, as soon as it has ended."""
        while (answer := self.exchange(f"/runs/{run_id}", prefer="wait=10")).status == 202:
            pass
        return answer.json


def exchange(
    address: Address,
    method: str,
    path: str,
    body: Body = None,
    headers: Mapping[str, str] | None = None,
    keep: int | None = None,
) -> Answer:
    """Sends a request over a separate connection, and reads the complete response.

    Args:
        address: Address of the service.
        method: HTTP method.
        path: Path below ``/api/v1``.
        body: Body; a mapping is sent as JSON.
        headers: Headers in addition to those of the body.
        keep: Number of bytes of the response that are kept; all by default.
    """
    given = dict(headers or {})
    if isinstance(body, Mapping):
        given.setdefault("Content-Type", "application/json")
        body = json.dumps(body).encode()
    connection = http.client.HTTPConnection(*address, timeout=PATIENCE)
    try:
        with suppress(BrokenPipeError, ConnectionResetError):
            # Rejected before the body was sent completely; the response gives the reason.
            connection.request(method, API + path, body, given)
        answer = connection.getresponse()
        named = {name.lower(): value for name, value in answer.getheaders()}
        content = answer.read(keep)
        while answer.read(1 << 16):
            pass
        return Answer(answer.status, named, content)
    finally:
        connection.close()


@contextmanager
def serve(
    folder: Path,
    program: Sequence[str] = ("slipgrasp", "serve"),
    environment: Mapping[str, str] | None = None,
    *,
    kill: bool = False,
) -> Iterator[Service]:
    """A context with a service on a folder that is ready.

    Args:
        folder: Folder of its data, and of its log.
        program: Main module with arguments; prints its URL first.
        environment: Variables in addition to those of this process.
        kill: Whether the context ends it by SIGKILL.
    """
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", *program, "--port", "0", "--data-dir", str(folder)]
    log, given = folder / "log.txt", os.environ | dict(environment or {})
    with (
        log.open("wb") as stream,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=stream, text=True, env=given
        ) as process,
    ):
        try:
            assert process.stdout is not None
            yield Service(process, process.stdout.readline().strip(), log)
        finally:
            process.send_signal(signal.SIGKILL if kill else signal.SIGTERM)
