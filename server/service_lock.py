"""The data folder of a service, protected from other users and other services.

Two services in one folder would not know each other's runs and limits.
"""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from slipgrasp.core.file_lock import try_lock
from slipgrasp.recordings.exceptions import FolderInUseError, RecordingWriteError

LOCK_NAME = "service.lock"
MAX_OWNER_LENGTH = 20

_PRIVATE = 0o700
_OPEN_TO_OTHERS = 0o077

_logger = logging.getLogger(__name__)


def make_private(folder: Path) -> None:
    """Denies other users access to a data folder.

    A folder that also has other purposes, judged by its content, owner or kind, is only reported:
    recordings in ``/tmp`` must not make it inaccessible to others.
    """
    if os.name != "posix":
        return
    found = folder.stat()
    if not found.st_mode & _OPEN_TO_OTHERS:
        return
    if found.st_uid == os.geteuid() and not found.st_mode & stat.S_ISVTX and _is_ours(folder):
        folder.chmod(_PRIVATE)
        return
    _logger.warning(
        "other users can read the data folder, which is not changed because it has other files"
    )


def _is_ours(folder: Path) -> bool:
    """Whether a folder is empty, or contains recordings or the lock of a service."""
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries]
    return not names or LOCK_NAME in names or any(name.endswith(".mcap") for name in names)


@contextmanager
def service_lock(folder: Path) -> Iterator[None]:
    """A context in which no other service can use the folder; the lock ends with this process.

    Args:
        folder: The data folder; it exists.

    Raises:
        FolderInUseError: If another service uses it.
        RecordingWriteError: If no file can be created in it.
    """
    with _open(folder / LOCK_NAME) as stream:
        if not _can_lock(stream):
            raise FolderInUseError(folder, _owner(stream))
        stream.truncate(0)
        stream.write(str(os.getpid()).encode())
        stream.flush()
        yield


def check_not_served(folder: Path) -> None:
    """Raises the errors of `service_lock` without locking the folder.

    Raises:
        FolderInUseError: If a service uses the folder.
        RecordingWriteError: If no file can be created in it.
    """
    with service_lock(folder):
        pass


def _can_lock(stream: BinaryIO) -> bool:
    """Returns False if another process holds the lock; True if locks are not supported."""
    try:
        return try_lock(stream)
    except OSError:
        return True


def _open(path: Path) -> BinaryIO:
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    try:
        return os.fdopen(os.open(path, flags, 0o666), "r+b")
    except OSError as error:
        raise RecordingWriteError(path, error.strerror or "no lock") from error


def _owner(stream: BinaryIO) -> str:
    """Id of the process that holds the lock; empty if unknown."""
    text = stream.read(MAX_OWNER_LENGTH).decode("ascii", errors="replace")
    return text if text.isdecimal() else ""
