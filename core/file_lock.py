"""Locks on open files that are released when their process ends for any reason."""

from __future__ import annotations

import sys
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt

    _FAR_BEYOND_THE_END = 1 << 62

    def try_lock(stream: BinaryIO) -> bool:
        """Locks a file until it is closed; returns False if another process holds the lock.

        Raises:
            OSError: If the file system has no locks.
        """
        position = stream.tell()
        stream.seek(_FAR_BEYOND_THE_END)
        try:
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        finally:
            stream.seek(position)
        return True

else:
    import fcntl

    def try_lock(stream: BinaryIO) -> bool:
        """Locks a file until it is closed; returns False if another process holds the lock.

        Raises:
            OSError: If the file system has no locks.
        """
        try:
            fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
