"""What the service has freed goes back to the system (glibc)."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

# The names of malloc.h.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8

LARGE_BYTES = 1_000_000
"""A larger block is the system's again at once when it is freed."""

KEPT_BYTES = 4_000_000
"""How much freed memory at the end of the heap is kept for what comes next."""

MAX_HEAPS = 2
"""Threads share so many heaps; each heap keeps some of what it once held."""

LOOK_SECONDS = 5.0
"""How often it is looked how much memory lies free."""


class _Words(ctypes.Structure):
    """What ``mallinfo2`` tells, by the names of malloc.h [bytes, but for the counts]."""

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
        free: What was freed and is still kept in the heaps, whether the system has it or not [B].
        unused: Anonymous memory that the process has and that no block of the heaps uses [B].
    """

    free: int
    unused: int


def give_back_freed_memory(look_seconds: float = LOOK_SECONDS) -> None:
    """Bounds what the C library keeps of freed memory; call it before threads are started.

    By itself glibc keeps a heap for each of many threads, and after the first large block also
    blocks of up to 32 MB in them: a service that reads recordings in threads grows for hours
    although all of it is freed. What is freed between blocks that are still in use it keeps
    even so; that goes back once it has lain free for a while. Elsewhere, and with a glibc before
    2.33, which cannot say how much that is, only the bounds are set.

    Args:
        look_seconds: How often it is looked how much lies free [s].
    """
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)
        library.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
        library.mallopt(_M_ARENA_MAX, MAX_HEAPS)
        library.mallinfo2.restype = _Words
        trimmer = Trimmer(partial(_look, library), partial(library.malloc_trim, 0))
        threading.Thread(target=_keep_looking, args=(trimmer, look_seconds), daemon=True).start()


class Trimmer:
    """Returns the free memory of all heaps to the system; takes about 10 ms.

    It is not done by what the process or the machine does meanwhile, but by the heaps: what lay
    free at two looks, and is more than after the last time, is not about to be used again.

    Args:
        look: Returns the free memory.
        trim: Gives it back.
    """

    def __init__(self, look: Callable[[], Heap], trim: Callable[[], object]) -> None:
        self._look = look
        self._trim = trim
        self._left = look().unused
        self._before = 0

    def work(self) -> None:
        """Checks once, and returns free memory if there is enough of it."""
        heap = self._look()
        self._left = min(self._left, heap.unused)
        # Trimmed memory stays free in the heaps; that of others, as of Python, is none of them.
        found = min(heap.free, heap.unused - self._left)
        if min(found, self._before) > KEPT_BYTES:
            self._trim()
            self._left, found = self._look().unused, 0
        self._before = found


def _look(library: ctypes.CDLL) -> Heap:
    told = library.mallinfo2()
    status = Path("/proc/self/status").read_text()
    anonymous = 1024 * int(status.partition("RssAnon:")[2].split()[0])
    return Heap(told.fordblks, anonymous - told.uordblks - told.hblkhd)


def _keep_looking(trimmer: Trimmer, look_seconds: float) -> None:
    while True:
        time.sleep(look_seconds)
        trimmer.work()
