"""What the service has freed goes back to the system (glibc)."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from contextlib import suppress

# The names of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8

LARGE_BYTES = 1_000_000
"""A larger block is the system's again at once when it is freed."""

KEPT_BYTES = 16_000_000
"""How much freed memory at the end of the heap is kept for what comes next."""

MAX_HEAPS = 2
"""Threads share so many heaps; each heap keeps some of what it once held."""


LOOK_SECONDS = 5.0
"""How often it is looked whether the service rests."""

RESTING_SHARE = 0.05
"""A process that uses less of one processor rests."""


def give_back_freed_memory(look_seconds: float = LOOK_SECONDS) -> None:
    """Bounds what the C library keeps of freed memory; call it before threads are started.

    By itself glibc keeps a heap for each of many threads, and after the first large block also
    blocks of up to 32 MB in them: a service that reads recordings in threads grows for hours
    although all of it is freed. What is freed between blocks that are still in use it keeps
    even so; that goes back whenever the process comes to rest, for it may take some 10 ms.
    Elsewhere this does nothing.

    Args:
        look_seconds: How often it is looked whether the process rests [s].
    """
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)
        library.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
        library.mallopt(_M_ARENA_MAX, MAX_HEAPS)
        trim = library.malloc_trim
        threading.Thread(target=_trim_at_rest, args=(trim, look_seconds), daemon=True).start()


def _trim_at_rest(trim: Callable[[int], int], look_seconds: float) -> None:
    """Gives back what is free in all heaps, once each time that the process comes to rest."""
    has_worked, before = True, time.process_time()
    while True:
        time.sleep(look_seconds)
        now = time.process_time()
        rests, before = now - before < RESTING_SHARE * look_seconds, now
        if rests and has_worked:
            trim(0)
        has_worked = not rests
