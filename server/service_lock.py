"""The data folder of a service: closed to other users of the machine, and to a second service.

Two services would not know of each other's runs and limits.
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
    """Closes a data folder to other users of the machine.

    A folder that serves others too, by what lies in it, whose it is or what it is, is only
    reported: who keeps recordings in ``/tmp`` does not want it closed to everyone else.
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
        "other users may read the data folder; it serves more than this, so it stays so"
    )


def _is_ours(folder: Path) -> bool:
    """Whether a folder is new, or was made for recordings."""
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries]
    return not names or LOCK_NAME in names or any(name.endswith(".mcap") for name in names)


@contextmanager
def service_lock(folder: Path) -> Iterator[None]:
    """Within it no other service can use the folder; the lock ends with this process.

    Args:
        folder: The data folder; it exists.

    Raises:
        FolderInUseError: If another service uses it.
        RecordingWriteError: If no file can be made in it.
    """
    with _open(folder / LOCK_NAME) as stream:
        if not _can_lock(stream):
            raise FolderInUseError(folder, _owner(stream))
        stream.truncate(0)
        stream.write(str(os.getpid()).encode())
        stream.flush()
        yield


def check_not_served(folder: Path) -> None:
    """Finds out at once what `service_lock` would find; the lock stays free.

    Raises:
        FolderInUseError: If a service uses the folder.
        RecordingWriteError: If no file can be made in it.
    """
    with service_lock(folder):
        pass


def _can_lock(stream: BinaryIO) -> bool:
    """False if another process holds the lock; a file system without locks cannot tell."""
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
    """Number of the process that holds the lock; empty if it does not say."""
    text = stream.read(MAX_OWNER_LENGTH).decode("ascii", errors="replace")
    return text if text.isdecimal() else ""
