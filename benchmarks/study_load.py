"""A study over REST, with a client that sends requests while it runs."""

from __future__ import annotations

import http.client
import json
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Self
from urllib.parse import urlsplit

import numpy as np

from benchmarks.processes import MemoryWatch

API = "/api/v1/studies"
PAUSE = 0.1
PAGE = 100
MAP_EVERY = 10.0  # [s]
PATIENCE = 900.0
KEPT_OPEN = 2.0


class Client:
    """Sends requests to a service, over one connection."""

    def __init__(self, url: str) -> None:
        """Connects.

        Args:
            url: URL of the service.
        """
        address = urlsplit(url)
        assert address.hostname is not None
        self._connection = http.client.HTTPConnection(
            address.hostname, address.port, timeout=PATIENCE
        )
        self._used = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._connection.close()

    def ask(self, path: str, body: Mapping[str, Any] | None = None) -> bytes:
        """The response of the service.

        Raises:
            AssertionError: If it is an error.
        """
        if time.monotonic() - self._used > KEPT_OPEN:
            self._connection.close()  # closed by the service; the next request opens another
        method = "GET" if body is None else "POST"
        content = None if body is None else json.dumps(body)
        headers = {} if body is None else {"Content-Type": "application/json"}
        self._connection.request(method, path, content, headers)
        answer = self._connection.getresponse()
        text = answer.read()
        self._used = time.monotonic()
        assert answer.status < 300, f"{method} {path}: {answer.status} {text[:500]!r}"
        return text


@dataclass(slots=True)
class Load:
    """Measurements of a client during a study.

    Attributes:
        study: Its id.
        seconds: Time from its first results to its last [s].
        runs: Number of runs finished in that time.
        waiting: Time from the request to the first results [s].
        answers: Response times of each kind [s].
    """

    study: str
    seconds: float = 0.0
    runs: int = 0
    waiting: float = 0.0
    answers: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    @classmethod
    def together(cls, loads: Sequence[Load]) -> Load:
        """Several measurements as one."""
        found = cls("", sum(load.seconds for load in loads), sum(load.runs for load in loads))
        for load in loads:
            for kind, times in load.answers.items():
                found.answers[kind] += times
        return found

    @property
    def rate(self) -> float:
        """Runs per second from first to last result."""
        return self.runs / self.seconds

    def percentile(self, share: float, kind: str | None = None) -> float:
        """Percentile of the response times, of a kind or all [s]."""
        kinds = self.answers if kind is None else [kind]
        return float(np.percentile([time for one in kinds for time in self.answers[one]], share))


def run_over_rest(client: Client, study: Mapping[str, Any], watch: MemoryWatch) -> Load:
    """Runs a study, and requests its status and other data until it is complete.

    Args:
        client: Client of the service.
        study: The study, as in a request.
        watch: Called with the progress.

    Raises:
        AssertionError: If it fails, or does not end within 15 minutes.
    """
    asked = time.perf_counter()
    created = json.loads(client.ask(API, study))
    load, count = Load(created["id"]), created["num_runs"]
    kinds = _kinds(f"{API}/{created['id']}")
    first = first_done = 0.0
    while True:
        status = json.loads(_timed(client, load, "status", f"{API}/{load.study}"))
        now = time.perf_counter()
        assert status["state"] in ("queued", "running", "completed"), status
        assert now - asked < PATIENCE, status
        done = watch.progress = status["finished"]
        if done and not first_done:
            first, first_done = now, done
        if done == count and status["state"] == "completed":
            break
        if done:
            kind, path = next(kinds)
            _timed(client, load, kind, path)
        time.sleep(PAUSE)
    load.seconds, load.runs, load.waiting = now - first, count - first_done, first - asked
    return load


def _kinds(study: str) -> Iterator[tuple[str, str]]:
    """The requests in turns, with an occasional map."""
    page = f"{study}/results?limit={PAGE}"
    drawn = time.monotonic()
    while True:
        yield "list of studies", f"{API}?limit={PAGE}"
        yield "page of results", page
        yield "page sorted by a metric", f"{page}&sort=-slip_path_0"
        if time.monotonic() - drawn > MAP_EVERY:
            yield "map", f"{study}/map.svg"
            drawn = time.monotonic()


def _timed(client: Client, load: Load, kind: str, path: str) -> bytes:
    start = time.perf_counter()
    answer = client.ask(path)
    load.answers[kind].append(time.perf_counter() - start)
    return answer
