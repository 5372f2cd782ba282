"""Memory and processor time of processes (Linux), samples of them, and background threads."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

_PROC, _ROOT = Path("/proc"), Path(__file__).parents[1]

S = TypeVar("S")


@contextmanager
def background_threads(*works: Callable[[threading.Event], object]) -> Iterator[None]:
    """A context with functions in threads; its end waits for them, and raises their errors.

    Args:
        *works: The functions; the event that they get is set at the end of the context.
    """
    ended = threading.Event()
    with ThreadPoolExecutor(len(works)) as pool:
        threads = [pool.submit(work, ended) for work in works]
        try:
            yield
        finally:
            ended.set()
    for thread in threads:
        thread.result()


@contextmanager
def watch(look: Callable[[], S], period: float) -> Iterator[list[S]]:
    """A context with samples that are taken in a separate thread.

    Args:
        look: Returns a present sample.
        period: Sampling interval [s].
    """
    samples: list[S] = []

    def take_samples(ended: threading.Event) -> None:
        samples.append(look())
        while not ended.wait(period):
            samples.append(look())

    with background_threads(take_samples):
        yield samples


def run_module(name: str, *arguments: str, variables: Mapping[str, str] | None = None) -> str:
    """Output of a module of this project in a separate process.

    Args:
        name: Its name.
        *arguments: Arguments of its command line.
        variables: Variables of the environment in addition to those of this process.
    """
    command, given = [sys.executable, "-m", name, *arguments], os.environ | dict(variables or {})
    return subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, cwd=_ROOT, env=given
    ).stdout


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
