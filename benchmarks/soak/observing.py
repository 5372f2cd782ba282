"""What a service and its workers hold, sampled while they work (Linux)."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from benchmarks.processes import Watch, family_of, memory_of, own_memory_of


class Sample(NamedTuple):
    """A moment.

    Attributes:
        time: Since the beginning [s].
        answers: How many there were so far.
        service_memory: Of the service, its part of shared pages in it [B].
        own_memory: What the service has written itself of that [B].
        worker_memory: Of all that it has started, likewise [B].
        service_descriptors: Files and sockets that the service has open.
        worker_descriptors: Those of all that it has started.
    """

    time: float
    answers: int
    service_memory: int
    own_memory: int
    worker_memory: int
    service_descriptors: int
    worker_descriptors: int


class Observer(Watch[Sample]):
    """Samples a service and its descendants.

    Args:
        process: Of the service.
        count: Gives how many answers there were so far.
        period: Between two samples [s].
    """

    def __init__(self, process: int, count: Callable[[], int], period: float) -> None:
        super().__init__(period)
        self._process = process
        self._count = count
        self._began = time.monotonic()

    def look(self) -> Sample:
        """A sample of now."""
        service, *workers = family_of(self._process)
        return Sample(
            time.monotonic() - self._began,
            self._count(),
            memory_of(service),
            own_memory_of(service),
            sum(map(memory_of, workers)),
            descriptors_of(service),
            sum(map(descriptors_of, workers)),
        )


def descriptors_of(process: int) -> int:
    """How many files and sockets a process has open; 0 once it has ended."""
    with suppress(OSError):
        return len(list(Path(f"/proc/{process}/fd").iterdir()))
    return 0
