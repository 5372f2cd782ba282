"""How much a folder of recordings may take, and what must stay free on its disk."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from slipgrasp.recordings.exceptions import RecordingWriteError, StorageFullError


@dataclass(frozen=True, slots=True, kw_only=True)
class StorageLimits:
    """Bounds on what is kept.

    Attributes:
        quota: Bytes that all files of the folder may take together.
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
            StorageFullError: If there is no room for them.
            RecordingWriteError: If the folder cannot be looked at.
        """
        try:
            used, free = _bytes_in(folder), shutil.disk_usage(folder).free
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "not readable") from error
        if used + incoming >= self.quota:
            raise StorageFullError.over_quota(folder, used, self.quota, incoming)
        if free - incoming < self.min_free:
            raise StorageFullError.low_disk(folder, free, self.min_free, incoming)


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
