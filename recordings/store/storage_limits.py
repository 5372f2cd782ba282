"""Limits of the size of a folder of recordings, and of the free space on its disk."""

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
"""Longest duration of a count of the files that is repeated every time [s]."""
_PAUSE = 50.0
"""Ratio of the interval between counts to the duration of a slow count."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StorageLimits:
    """Limits of storage.

    Attributes:
        quota: Largest total size of all files in the folder [bytes]. Large folders are not counted
            every time, so the data of a few seconds may exceed it.
        min_free: Smallest free space on its disk [bytes].
    """

    quota: int = 20_000_000_000
    min_free: int = 200_000_000

    def check(self, folder: Path, incoming: int = 0) -> None:
        """Raises an error if the limits would be exceeded.

        Args:
            folder: The existing folder.
            incoming: Size of the new file [bytes], as far as known.

        Raises:
            StorageFullError: If there is no space for them.
            RecordingWriteError: If the folder cannot be read.
        """
        try:
            size, free = _size_of(folder), shutil.disk_usage(folder).free
            used = size.count()
            if used + incoming >= self.quota:
                # Files may have been deleted since the last count.
                used = size.count(anew=True)
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "not readable") from error
        if used + incoming >= self.quota:
            raise StorageFullError.over_quota(folder, used, self.quota, incoming)
        if free - incoming < self.min_free:
            raise StorageFullError.low_disk(folder, free, self.min_free, incoming)


class _FolderSize:
    """Counts the bytes in a folder; slow counts take at most a fiftieth of the time.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = Lock()
        self._bytes = 0
        self._due = 0.0

    def count(self, *, anew: bool = False) -> int:
        """Sizes of all files, possibly slightly outdated.

        Args:
            anew: Whether the sizes must be up to date.

        Raises:
            OSError: If the folder cannot be read.
        """
        with self._lock:
            if anew or time.monotonic() >= self._due:
                # Measured in processor time, so that other load does not age the count.
                began = time.thread_time()
                self._bytes = _bytes_in(self._folder)
                cost = time.thread_time() - began
                self._due = time.monotonic() + (_PAUSE * cost if cost > _CHEAP else 0.0)
            return self._bytes


@lru_cache(maxsize=16)
def _size_of(folder: Path) -> _FolderSize:
    return _FolderSize(folder)


def _bytes_in(folder: Path) -> int:
    """Sizes of the files in a folder and its subfolders, including unfinished ones."""
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
