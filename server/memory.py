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

# The names of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8

ARROW_POOL = "ARROW_DEFAULT_MEMORY_POOL"
"""Environment variable with the allocator of pyarrow, which reads it once."""

LARGE_BYTES = 1_000_000
"""Blocks above this size are returned to the system when they are freed."""

KEPT_BYTES = 4_000_000
"""Freed memory at the end of the heap that is retained."""

MAX_HEAPS = 2
"""Number of heaps that threads share; each heap retains some freed memory."""

LOOK_SECONDS = 10.0
"""Interval between trims of the heaps, each of which takes about 10 ms."""

IDLE_SHARE = 0.05
"""A service that uses less than this fraction of a processor is idle."""

FEW_BLOCKS = 5_000
"""Change of the number of objects below which collecting them is not worth its time."""


def give_back_freed_memory(look_seconds: float = LOOK_SECONDS) -> None:
    """Limits the freed memory that the C library retains; must be called before threads start.

    By default glibc has a heap for each of many threads, and after the first large block also keeps
    blocks of up to 32 MB in them: a service that reads recordings in threads grows for hours
    although all memory is freed. Memory freed between used blocks is retained anyway, and returned
    at intervals. The default allocator of pyarrow, which nothing trims, retained up to 20 MB, so
    that pyarrow uses the heaps instead. Nothing changes on systems without glibc.

    Args:
        look_seconds: Interval between trims of the heaps [s].
    """
    os.environ.setdefault(ARROW_POOL, "system")
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)
        library.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
        library.mallopt(_M_ARENA_MAX, MAX_HEAPS)
        arguments = library.malloc_trim, look_seconds
        threading.Thread(target=_keep_trimming, args=arguments, daemon=True).start()


def _keep_trimming(trim: Callable[[int], object], look_seconds: float) -> None:
    """Trims the heaps at intervals, after unreachable objects were freed if the process is idle.

    Python frees reference cycles only after many new objects, and a few cycles may hold large
    arrays: figures of a service at rest held 100 MB. Collecting takes some 0.1 s.
    """
    used, blocks = time.process_time(), sys.getallocatedblocks()
    while True:
        time.sleep(look_seconds)
        before, used = used, time.process_time()
        is_idle = used - before < IDLE_SHARE * look_seconds
        if is_idle and abs(sys.getallocatedblocks() - blocks) > FEW_BLOCKS:
            gc.collect()
            used, blocks = time.process_time(), sys.getallocatedblocks()
        trim(0)
