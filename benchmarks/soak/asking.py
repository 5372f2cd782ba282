"""Requests whose responses are counted, and compared with the specification."""

from __future__ import annotations

import http.client
import threading
from collections import Counter
from collections.abc import Iterable, Mapping

from benchmarks.service import Address, Answer, Body, exchange

BUSY = 503
PROBLEM = "application/problem+json"
MAX_FAULTS = 100


class Tally:
    """Sends requests, counts responses by kind and status, and stores deviations.

    Args:
        address: Address of the service.

    Attributes:
        address: The same.
        counts: Number of responses, by kind and by status or other end.
        faults: Descriptions of the first hundred deviations from the specification.
    """

    def __init__(self, address: Address) -> None:
        self.address = address
        self.counts: Counter[tuple[str, str]] = Counter()
        self.faults: list[str] = []
        self._lock = threading.Lock()

    @property
    def total(self) -> int:
        """Number of responses."""
        with self._lock:
            return self.counts.total()

    def note(self, kind: str, ending: str) -> None:
        """Counts a response, or another end of a connection."""
        with self._lock:
            self.counts[kind, ending] += 1

    def blame(self, kind: str, words: str) -> None:
        """Stores a deviation from the specification."""
        with self._lock:
            if len(self.faults) < MAX_FAULTS:
                self.faults.append(f"{kind}: {words}")

    def expect(self, kind: str, holds: bool, words: str) -> None:
        """Stores a description if a condition is not met."""
        if not holds:
            self.blame(kind, words)

    def ask(
        self,
        kind: str,
        method: str,
        path: str,
        expected: Iterable[int],
        body: Body = None,
        headers: Mapping[str, str] | None = None,
        keep: int | None = None,
    ) -> Answer:
        """Sends a request, counts the response, and records deviations from the specification.

        Args:
            kind: Kind in the counts.
            method: HTTP method.
            path: Path below ``/api/v1``.
            expected: Allowed statuses.
            body: Body; a mapping is sent as JSON.
            headers: Headers in addition to those of the body.
            keep: Number of bytes of the response that are kept; all by default.

        Raises:
            ConnectionError: If there is no response.
        """
        try:
            answer = exchange(self.address, method, path, body, headers, keep)
        except (OSError, http.client.HTTPException) as error:
            raise ConnectionError(f"{method} {path[:200]}: {error!r}") from error
        self.note(kind, str(answer.status))
        for fault in find_faults(answer, expected, method):
            self.blame(kind, f"{method} {path[:200]}: {fault}")
        return answer


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
