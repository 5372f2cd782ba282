"""Memory and processor time of a process and its descendants, while it works (Linux)."""

from __future__ import annotations

import os
import re
import threading
from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Generic, NamedTuple, Self, TypeVar

_PERIOD = 0.25
_PROC = Path("/proc")
_PROPORTIONAL = "Pss"
_OWN = "Anonymous"


S = TypeVar("S")


class Sample(NamedTuple):
    """Memory at one instant.

    Attributes:
        progress: Progress of the work.
        memory: Of all processes together, shared pages counted once [B].
    """

    progress: float
    memory: int


class Watch(ABC, Generic[S]):
    """Takes samples in a separate thread inside its ``with`` block.

    Args:
        period: Sampling interval [s].

    Attributes:
        samples: The samples so far.
    """

    def __init__(self, period: float) -> None:
        self.samples: list[S] = []
        self._period = period
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    @abstractmethod
    def look(self) -> S:
        """A present sample."""

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
        super().__init__(_PERIOD)
        self.progress = 0.0
        self._process = process

    @property
    def peak(self) -> int:
        """Peak memory so far [B]."""
        return max(sample.memory for sample in self.samples)

    def look(self) -> Sample:
        """Progress of the work, and the memory of all processes."""
        progress = self.progress
        return Sample(progress, sum(map(memory_of, family_of(self._process))))


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
    return _rolled_up(process, _PROPORTIONAL)


def own_memory_of(process: int) -> int:
    """Memory that a process itself has written; 0 after its end [B].

    Mapped files are excluded, because its part of them depends on the other processes.
    """
    return _rolled_up(process, _OWN)


def _rolled_up(process: int, kind: str) -> int:
    with suppress(OSError):
        text = (_PROC / str(process) / "smaps_rollup").read_text(encoding="ascii")
        if (found := re.search(rf"^{kind}:\s*(\d+) kB", text, re.MULTILINE)) is not None:
            return 1024 * int(found[1])
    return 0


def processor_time_of(process: int) -> float:
    """Processor time of a process so far, in all threads [s]."""
    text = (_PROC / str(process) / "stat").read_text(encoding="ascii")
    words = text.rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
