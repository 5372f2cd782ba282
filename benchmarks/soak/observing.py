"""What a service and its workers hold, sampled while they work (Linux)."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from benchmarks.processes import family_of, memory_of


class Sample(NamedTuple):
    """A moment.

    Attributes:
        time: Since the beginning [s].
        answers: How many there were so far.
        service_memory: Of the service, its part of shared pages in it [B].
        worker_memory: Of all that it has started, likewise [B].
        service_descriptors: Files and sockets that the service has open.
        worker_descriptors: Those of all that it has started.
    """

    time: float
    answers: int
    service_memory: int
    worker_memory: int
    service_descriptors: int
    worker_descriptors: int


class Observer:
    """Samples a process and its descendants inside its ``with`` block.

    Args:
        process: Of the service.
        count: Gives how many answers there were so far.
        period: Between two samples [s].

    Attributes:
        samples: What was found so far.
    """

    def __init__(self, process: int, count: Callable[[], int], period: float) -> None:
        self.samples: list[Sample] = []
        self._process = process
        self._count = count
        self._period = period
        self._began = time.monotonic()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._ended.set()
        self._thread.join()

    def look(self) -> Sample:
        """A sample of now."""
        service, *workers = family_of(self._process)
        return Sample(
            time.monotonic() - self._began,
            self._count(),
            memory_of(service),
            sum(map(memory_of, workers)),
            descriptors_of(service),
            sum(map(descriptors_of, workers)),
        )

    def _watch(self) -> None:
        while True:
            self.samples.append(self.look())
            if self._ended.wait(self._period):
                return


def descriptors_of(process: int) -> int:
    """How many files and sockets a process has open; 0 once it has ended."""
    with suppress(OSError):
        return len(list(Path(f"/proc/{process}/fd").iterdir()))
    return 0
