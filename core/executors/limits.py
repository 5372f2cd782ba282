"""Resource limits of tasks, so that a task with excessive demands harms no other."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

OUT_OF_MEMORY = 12
"""Exit status of a worker that has exhausted its memory: errno's ENOMEM."""

LEAST_MEMORY = 1_000_000_000
SHARE_OF_MEMORY = 0.5
"""Fraction of the machine for all workers; the rest is for the process that starts them."""

_CGROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")
_OOM_SCORE = Path("/proc/self/oom_score_adj")


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerLimits:
    """Limits of one worker process.

    Attributes:
        memory: Memory limit [bytes]; enforced if the system supports it (Linux).
        task_seconds: Time limit of one task [s]; far longer than a run may compute.
    """

    memory: int
    task_seconds: float = 180.0

    @classmethod
    def shared_by(cls, num_workers: int) -> Self:
        """Limits of each of several workers on this machine."""
        return cls(
            memory=max(LEAST_MEMORY, round(SHARE_OF_MEMORY * machine_memory() / num_workers))
        )


def bound_memory(num_bytes: int) -> None:
    """Limits the memory of this process, and makes the system kill it first if memory is short."""
    try:
        import resource
    except ImportError:
        return
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    soft = num_bytes if hard == resource.RLIM_INFINITY else min(num_bytes, hard)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
    with suppress(OSError):
        _OOM_SCORE.write_text("500")


def machine_memory() -> int:
    """Memory of this machine, or of the container [bytes]; 0 if unknown."""
    with suppress(OSError, ValueError):
        return int(_CGROUP_LIMIT.read_text())
    with suppress(AttributeError, OSError, ValueError):
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return 0
