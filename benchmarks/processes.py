"""Memory and processor time of a process and its descendants, while it works (Linux)."""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Generic, NamedTuple, Self, TypeVar

_PERIOD = 0.25
_PROC = Path("/proc")


S = TypeVar("S")


class Sample(NamedTuple):
    """Memory at one instant.

    Attributes:
        progress: Progress of the work.
        memory: Of all processes together, shared pages counted once [B].
    """

    progress: float
    memory: int


class Watch(Generic[S]):
    """Takes samples in a separate thread inside its ``with`` block.

    Args:
        look: Returns a present sample.
        period: Sampling interval [s].

    Attributes:
        look: The same function.
        samples: The samples so far.
    """

    def __init__(self, look: Callable[[], S], period: float) -> None:
        self.samples: list[S] = []
        self.look, self._period = look, period
        self._ended = threading.Event()
        self._thread = ThreadPoolExecutor(1)

    def __enter__(self) -> Self:
        self._watching = self._thread.submit(self._watch)
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._watching.result()
        self._thread.shutdown()

    def _watch(self) -> None:
        while True:
            self.samples.append(self.look())
            if self._ended.wait(self._period):
                return


class MemoryWatch(Watch[Sample]):
    """Samples the memory of a process and its descendants.

    Attributes:
        progress: Progress of the work, as reported by the worker.
    """

    def __init__(self, process: int) -> None:
        def look() -> Sample:
            progress = self.progress
            return Sample(progress, sum(map(memory_of, family_of(process))))

        super().__init__(look, _PERIOD)
        self.progress = 0.0

    @property
    def peak(self) -> int:
        """Peak memory so far [B]."""
        return max(sample.memory for sample in self.samples)


def family_of(process: int) -> list[int]:
    """A process and all its descendants."""
    found = [process]
    for parent in found:
        with suppress(OSError):
            for children in (_PROC / str(parent) / "task").glob("*/children"):
                found += map(int, children.read_text(encoding="ascii").split())
    return found


def memory_of(process: int) -> int:
    """Memory of a process, including its part of shared pages; 0 after its end [B]."""
    return _kilobytes(process, "smaps_rollup", "Pss")


def own_memory_of(process: int) -> int:
    """Memory that a process itself has written; 0 after its end [B].

    Mapped files are excluded, because its part of them depends on the other processes.
    """
    return _kilobytes(process, "smaps_rollup", "Anonymous")


def peak_of(process: int) -> int:
    """Peak resident memory of a process so far; 0 after its end [B]."""
    return _kilobytes(process, "status", "VmHWM")


def _kilobytes(process: int, file: str, kind: str) -> int:
    with suppress(OSError):
        text = (_PROC / str(process) / file).read_text(encoding="utf-8")
        if (found := re.search(rf"^{kind}:\s*(\d+) kB", text, re.MULTILINE)) is not None:
            return 1024 * int(found[1])
    return 0


def processor_time_of(process: int) -> float:
    """Processor time of a process so far, in all threads [s]."""
    text = (_PROC / str(process) / "stat").read_text(encoding="ascii")
    words = text.rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
