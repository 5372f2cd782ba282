"""A study over REST, with a client that sends requests while it runs."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.service import PATIENCE, Service

STUDIES = "/studies"
PAUSE = 0.1
PAGE = 100
MAP_EVERY = 10.0  # [s]


@dataclass(slots=True)
class Load:
    """Measurements of a client during studies.

    Attributes:
        seconds: Time from first results to last ones [s].
        answers: Response times of each kind [s].
        finished: Number of finished runs of the present study.
    """

    seconds: float = 0.0
    answers: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    finished: int = 0

    @property
    def asked(self) -> int:
        """Number of responses."""
        return sum(map(len, self.answers.values()))

    def percentile(self, share: float) -> float:
        """Percentile of all response times [s]."""
        return float(np.percentile([t for times in self.answers.values() for t in times], share))


def run_over_rest(service: Service, study: Mapping[str, Any], load: Load) -> tuple[str, float]:
    """Runs a study, and requests its status and other data until it is complete.

    Args:
        service: The service.
        study: The study, as in a request.
        load: Receives the measurements.

    Returns:
        The id of the study, and its rate from its first results to its last [1/s].

    Raises:
        AssertionError: If it fails, or does not end within 15 minutes.
    """
    asked = time.perf_counter()
    created = service.ask(STUDIES, study)
    path = f"{STUDIES}/{created['id']}"
    kinds = _kinds(path)
    first = first_done = 0.0
    while True:
        before = time.perf_counter()
        status = service.ask(path)
        now = time.perf_counter()
        load.answers["status"].append(now - before)
        assert status["state"] in ("queued", "running", "completed"), status
        assert now - asked < PATIENCE, status
        done = load.finished = status["finished"]
        if done and not first_done:
            first, first_done = now, done
        if done == created["num_runs"] and status["state"] == "completed":
            break
        if done:
            kind, page = next(kinds)
            load.answers[kind].append(service.seconds_of(page))
        time.sleep(PAUSE)
    load.seconds += now - first
    return created["id"], (done - first_done) / (now - first) if now > first else 0.0


def _kinds(study: str) -> Iterator[tuple[str, str]]:
    """The requests in turns, with an occasional map."""
    page = f"{study}/results?limit={PAGE}"
    drawn = time.monotonic()
    while True:
        yield "list of studies", f"{STUDIES}?limit={PAGE}"
        yield "page of results", page
        yield "page sorted by a metric", f"{page}&sort=-slip_path_0"
        if time.monotonic() - drawn > MAP_EVERY:
            yield "map", f"{study}/map.svg"
            drawn = time.monotonic()
