"""Resources of a service and its workers, sampled while they work (Linux)."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from benchmarks.processes import Watch, family_of, memory_of, own_memory_of


class Sample(NamedTuple):
    """Resources at one instant.

    Attributes:
        time: Time since the start [s].
        answers: Number of responses so far.
        service_memory: Memory of the service, including its part of shared pages [B].
        own_memory: The part of it that the service has written itself [B].
        worker_memory: Memory of its descendants, including their parts of shared pages [B].
        service_descriptors: Number of open files and sockets of the service.
        worker_descriptors: Number of those of its descendants.
    """

    time: float
    answers: int
    service_memory: int
    own_memory: int
    worker_memory: int
    service_descriptors: int
    worker_descriptors: int


def observe(process: int, count: Callable[[], int], period: float) -> Watch[Sample]:
    """Samples a service and its descendants.

    Args:
        process: Process of the service.
        count: Returns the number of responses so far.
        period: Sampling interval [s].
    """
    began = time.monotonic()

    def look() -> Sample:
        service, *workers = family_of(process)
        return Sample(
            time.monotonic() - began,
            count(),
            memory_of(service),
            own_memory_of(service),
            sum(map(memory_of, workers)),
            descriptors_of(service),
            sum(map(descriptors_of, workers)),
        )

    return Watch(look, period)


def descriptors_of(process: int) -> int:
    """Number of open files and sockets of a process; 0 after its end."""
    with suppress(OSError):
        return len(list(Path(f"/proc/{process}/fd").iterdir()))
    return 0
