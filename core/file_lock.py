"""Locks on open files that end with the process that holds them, however it ends."""

from __future__ import annotations

import sys
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt

    _FAR_BEYOND_THE_END = 1 << 62

    def try_lock(stream: BinaryIO) -> bool:
        """Locks a file until it is closed; False if another process holds it.

        Raises:
            OSError: If its file system has no locks.
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
        """Locks a file until it is closed; False if another process holds it.

        Raises:
            OSError: If its file system has no locks.
        """
        try:
            fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
