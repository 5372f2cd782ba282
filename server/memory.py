"""Frees unreachable objects of an idle service, and returns freed memory to the system (glibc)."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

# The names of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8

ARROW_POOL = "ARROW_DEFAULT_MEMORY_POOL"
"""Environment variable with the allocator of pyarrow, which reads it once."""

LARGE_BYTES = 1_000_000
"""Blocks above this size are returned to the system when they are freed."""

KEPT_BYTES = 4_000_000
"""Freed memory at the end of the heap that is retained."""

TRIMMED_BYTES = 1_000_000
"""Freed memory that is returned to the system if it stays free."""

MAX_HEAPS = 2
"""Number of heaps that threads share; each heap retains some freed memory."""

LOOK_SECONDS = 5.0
"""Interval between checks of the free memory."""

IDLE_SHARE = 0.05
"""A service that uses less than this fraction of a processor is idle."""

FEW_BLOCKS = 5_000
"""Change of the number of objects below which collecting them is not worth its time."""


class _Words(ctypes.Structure):
    """Result of ``mallinfo2``, with the names of malloc.h [bytes, except for counts]."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


@dataclass(frozen=True, slots=True)
class Heap:
    """Memory of this process.

    Attributes:
        free: Freed memory in the heaps, whether returned to the system or not [B].
        unused: Anonymous memory of the process that no block of the heaps uses [B].
    """

    free: int
    unused: int


def give_back_freed_memory(look_seconds: float = LOOK_SECONDS) -> None:
    """Limits the freed memory that the C library retains; must be called before threads start.

    By default glibc has a heap for each of many threads, and after the first large block also keeps
    blocks of up to 32 MB in them: a service that reads recordings in threads grows for hours
    although all memory is freed. Memory freed between used blocks is retained anyway; it is
    returned after it has been free for some time. The default allocator of pyarrow, which nothing
    trims, retained up to 20 MB, so that pyarrow uses the heaps instead. On other systems, and with
    glibc before 2.33, which cannot report this memory, only the limits are set.

    Args:
        look_seconds: Interval between checks of the free memory [s].
    """
    os.environ.setdefault(ARROW_POOL, "system")
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)
        library.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
        library.mallopt(_M_ARENA_MAX, MAX_HEAPS)
        library.mallinfo2.restype = _Words
        trimmer = Trimmer(partial(_look, library), partial(library.malloc_trim, 0))
        collector = Collector(IDLE_SHARE * look_seconds)
        arguments = collector, trimmer, look_seconds
        threading.Thread(target=_keep_looking, args=arguments, daemon=True).start()


class Collector:
    """Frees unreachable reference cycles while the process is idle; takes some 0.1 s.

    Python does so only after many new objects, and a few cycles may hold large arrays: figures of
    a service at rest held 100 MB.

    Args:
        most_seconds: Processor time between two checks below which the process is idle [s].
    """

    def __init__(self, most_seconds: float) -> None:
        self._most_seconds = most_seconds
        self._used, self._blocks = time.process_time(), sys.getallocatedblocks()

    def work(self) -> None:
        """Checks once, and collects if there are many new objects."""
        used = time.process_time()
        is_idle, self._used = used - self._used < self._most_seconds, used
        if is_idle and abs(sys.getallocatedblocks() - self._blocks) > FEW_BLOCKS:
            gc.collect()
            self._used, self._blocks = time.process_time(), sys.getallocatedblocks()


class Trimmer:
    """Returns the free memory of all heaps to the system; takes about 10 ms.

    This depends only on the heaps: memory that was free in two checks, and exceeds that after the
    last trim, is not about to be reused.

    Args:
        look: Returns the free memory.
        trim: Returns the memory to the system.
    """

    def __init__(self, look: Callable[[], Heap], trim: Callable[[], object]) -> None:
        self._look = look
        self._trim = trim
        self._left = look().unused
        self._before = 0

    def work(self) -> None:
        """Checks once, and trims the heaps if there is enough free memory."""
        heap = self._look()
        self._left = min(self._left, heap.unused)
        # Trimmed memory is still counted as free in the heaps.
        found = min(heap.free, heap.unused - self._left)
        if min(found, self._before) > TRIMMED_BYTES:
            self._trim()
            self._left, found = self._look().unused, 0
        self._before = found


def _look(library: ctypes.CDLL) -> Heap:
    told = library.mallinfo2()
    status = Path("/proc/self/status").read_text()
    anonymous = 1024 * int(status.partition("RssAnon:")[2].split()[0])
    return Heap(told.fordblks, anonymous - told.uordblks - told.hblkhd)


def _keep_looking(collector: Collector, trimmer: Trimmer, look_seconds: float) -> None:
    while True:
        time.sleep(look_seconds)
        collector.work()
        trimmer.work()
