"""Requests whose responses are counted, and compared with the specification."""

from __future__ import annotations

import http.client
import json
import threading
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

API = "/api/v1"
BUSY = 503
PATIENCE = 90.0
KEPT_OPEN = 0.5
PROBLEM = "application/problem+json"
MAX_FAULTS = 100

Address = tuple[str, int]


class Answer(NamedTuple):
    """Response to a request.

    Attributes:
        status: HTTP status.
        headers: Headers by lower-case name.
        content: The complete body.
    """

    status: int
    headers: dict[str, str]
    content: bytes

    @property
    def json(self) -> Any:
        """The body, decoded."""
        return json.loads(self.content)


class Tally:
    """Counts responses by kind and status, and stores deviations from the specification.

    Attributes:
        counts: Number of responses, by kind and by status or other end.
        slowest: Longest time until a complete response, by kind [s].
        faults: Descriptions of the first hundred deviations from the specification.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self.slowest: dict[str, float] = {}
        self.faults: list[str] = []
        self._lock = threading.Lock()

    @property
    def total(self) -> int:
        """Number of responses."""
        with self._lock:
            return self.counts.total()

    def note(self, kind: str, ending: str, seconds: float = 0.0) -> None:
        """Counts a response, or another end of a connection."""
        with self._lock:
            self.counts[kind, ending] += 1
            self.slowest[kind] = max(seconds, self.slowest.get(kind, 0.0))

    def blame(self, kind: str, words: str) -> None:
        """Stores a deviation from the specification."""
        with self._lock:
            if len(self.faults) < MAX_FAULTS:
                self.faults.append(f"{kind}: {words}")

    def expect(self, kind: str, holds: bool, words: str) -> None:
        """Stores a description if a condition is not met."""
        if not holds:
            self.blame(kind, words)


class Asker:
    """Sends requests over one connection, which it renews; for one thread.

    Args:
        address: Address of the service.
        tally: Counts every response.
    """

    def __init__(self, address: Address, tally: Tally) -> None:
        self.tally = tally
        self._address = address
        self._connection = http.client.HTTPConnection(*address, timeout=PATIENCE)
        self._used = 0.0

    def close(self) -> None:
        """Closes the connection."""
        self._connection.close()

    def ask(
        self,
        kind: str,
        method: str,
        path: str,
        expected: Iterable[int],
        body: bytes | Mapping[str, Any] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> Answer:
        """Sends a request, counts the response, and records deviations from the specification.

        Args:
            kind: Kind in the counts.
            method: HTTP method.
            path: Path below ``/api/v1``.
            expected: Allowed statuses.
            body: Body; a mapping is sent as JSON.
            headers: Headers in addition to those of the body.

        Raises:
            ConnectionError: If there is no response.
        """
        given = dict(headers or {})
        if isinstance(body, Mapping):
            given.setdefault("Content-Type", "application/json")
            body = json.dumps(body).encode()
        started = time.perf_counter()
        try:
            answer = self._exchange(method, API + path, body, given)
        except (OSError, http.client.HTTPException) as error:
            raise ConnectionError(f"{method} {path[:200]}: {error!r}") from error
        self.tally.note(kind, str(answer.status), time.perf_counter() - started)
        for fault in find_faults(answer, expected, method):
            self.tally.blame(kind, f"{method} {path[:200]}: {fault}")
        return answer

    def _exchange(
        self, method: str, path: str, body: bytes | None, headers: Mapping[str, str]
    ) -> Answer:
        if time.monotonic() - self._used > KEPT_OPEN:
            self._connection.close()  # closed by the service; the next request opens another
        with suppress(BrokenPipeError, ConnectionResetError):
            # Rejected before the body was sent completely; the response gives the reason.
            self._connection.request(method, path, body, dict(headers))
        try:
            answer = self._connection.getresponse()
            named = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, named, answer.read())
        finally:
            self._used = time.monotonic()


def find_faults(answer: Answer, expected: Iterable[int], method: str = "GET") -> list[str]:
    """Deviations of a response from the specification: its status, and common properties."""
    faults = []
    if answer.status not in expected:
        faults.append(f"{answer.status} {answer.content[:300]!r}")
    if answer.headers.get("x-content-type-options") != "nosniff":
        faults.append(f"{answer.status} without the safe headers")
    if answer.status == BUSY and not answer.headers.get("retry-after", "").isdigit():
        faults.append("503 without Retry-After")
    if answer.status >= 400 and method != "HEAD":
        faults += _faults_of_problem(answer)
    return faults


def _faults_of_problem(answer: Answer) -> list[str]:
    try:
        problem = answer.json
    except ValueError:
        return [f"{answer.status} without problem details: {answer.content[:300]!r}"]
    if answer.headers.get("content-type") != PROBLEM or problem.get("status") != answer.status:
        return [f"{answer.status} with other problem details: {answer.content[:300]!r}"]
    if not problem.get("detail") or "Traceback" in problem["detail"]:
        return [f"{answer.status} does not say what is wrong: {answer.content[:300]!r}"]
    return []
