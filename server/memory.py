"""What the service has freed goes back to the system (glibc)."""

from __future__ import annotations

import ctypes
from contextlib import suppress

# The names of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8

LARGE_BYTES = 1_000_000
"""A larger block is the system's again at once when it is freed."""

KEPT_BYTES = 16_000_000
"""How much freed memory at the end of the heap is kept for what comes next."""

MAX_HEAPS = 2
"""Threads share so many heaps; each heap keeps some of what it once held."""


def give_back_freed_memory() -> None:
    """Bounds what the C library keeps of freed memory; call it before threads are started.

    By itself glibc keeps a heap for each of many threads, and after the first large block also
    blocks of up to 32 MB in them: a service that reads recordings in threads grows for hours
    although all of it is freed. Elsewhere this does nothing.
    """
    with suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)
        mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
        mallopt(_M_ARENA_MAX, MAX_HEAPS)
