"""How much a folder of recordings may take, and what must stay free on its disk."""

from __future__ import annotations

import os
import shutil
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import Lock

from slipgrasp.recordings.exceptions import RecordingWriteError, StorageFullError

_CHEAP = 1e-3
"""Files that are counted as fast are counted every time [s]."""
_PAUSE = 50.0
"""How many times longer than a slow count it takes until there is another one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StorageLimits:
    """Bounds on what is kept.

    Attributes:
        quota: Bytes that all files of the folder may take together. Thousands of them are not
            counted every time, so that it may be exceeded by what was written in some seconds.
        min_free: Bytes that must stay free on its disk.
    """

    quota: int = 20_000_000_000
    min_free: int = 200_000_000

    def check(self, folder: Path, incoming: int = 0) -> None:
        """Refuses what would go beyond the bounds.

        Args:
            folder: The folder; it exists.
            incoming: Bytes to come, as far as known.

        Raises:
            StorageFullError: If there is no space for them.
            RecordingWriteError: If the folder cannot be looked at.
        """
        try:
            size, free = _size_of(folder), shutil.disk_usage(folder).free
            used = size.count()
            if used + incoming >= self.quota:
                # Something may have been deleted since.
                used = size.count(anew=True)
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "not readable") from error
        if used + incoming >= self.quota:
            raise StorageFullError.over_quota(folder, used, self.quota, incoming)
        if free - incoming < self.min_free:
            raise StorageFullError.low_disk(folder, free, self.min_free, incoming)


class _FolderSize:
    """Bytes in a folder; to count many files never takes more than a fiftieth of the time.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = Lock()
        self._bytes = 0
        self._due = 0.0

    def count(self, *, anew: bool = False) -> int:
        """Sizes of all files, as they are or were a moment ago.

        Args:
            anew: Whether they must be as they are.

        Raises:
            OSError: If the folder cannot be read.
        """
        with self._lock:
            if anew or time.monotonic() >= self._due:
                # What it costs: a machine that is busy otherwise makes it no older.
                began = time.thread_time()
                self._bytes = _bytes_in(self._folder)
                cost = time.thread_time() - began
                self._due = time.monotonic() + (_PAUSE * cost if cost > _CHEAP else 0.0)
            return self._bytes


@lru_cache(maxsize=16)
def _size_of(folder: Path) -> _FolderSize:
    return _FolderSize(folder)


def _bytes_in(folder: Path) -> int:
    """Sizes of the files in a folder and below, also of those that are still being written."""
    total = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                if entry.is_file(follow_symlinks=False):
                    total += entry.stat(follow_symlinks=False).st_size
                elif entry.is_dir(follow_symlinks=False):
                    total += _bytes_in(Path(entry))
            except FileNotFoundError:
                continue
    return total
