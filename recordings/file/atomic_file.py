"""Files that appear complete or not at all."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from slipgrasp.core.file_lock import try_lock
from slipgrasp.recordings.exceptions import (
    RecordingBusyError,
    RecordingExistsError,
    RecordingWriteError,
)

PART_SUFFIX = ".part"
RECORDING_PART = ".mcap.part"
_POLL = 0.001


@contextmanager
def atomic_file(
    path: Path,
    *,
    overwrite: bool,
    part_suffix: str = PART_SUFFIX,
    keep_part: bool = False,
    publish: Callable[[Path, Path], None] = os.replace,
) -> Iterator[BinaryIO]:
    """Opens a new file that gets its final name only when it is complete and on disk.

    The unfinished file is ``NAME.part``, locked by this process, so that two writers of one file
    cannot conflict. An unlocked part is replaced, unless it is that of a recording. An error leaves
    an existing file unchanged.

    Args:
        path: Final name of the file.
        overwrite: Whether to replace an existing file.
        part_suffix: Suffix of the unfinished file.
        keep_part: Whether an error leaves the unfinished file for recovery.
        publish: Renames the complete file to its final name.

    Yields:
        The stream to write to.

    Raises:
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingBusyError: If its ``.part`` is being written, or is that of a recording.
        RecordingWriteError: If the disk or its permissions do not allow it.
    """
    part = path.with_name(path.name + part_suffix)
    if not overwrite and path.exists():
        raise RecordingExistsError(path)
    try:
        _remove_remains(part)
        stream = _create(part)
    except FileExistsError:
        raise RecordingBusyError(path, _words_for_existing(part)) from None
    except OSError as error:
        raise RecordingWriteError(path, _words(error)) from error
    complete = False
    try:
        with stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            if not overwrite and path.exists():
                raise RecordingExistsError(path)
            if os.name != "posix":
                stream.close()  # elsewhere only a closed file can be renamed
            publish(part, path)
            complete = True
        sync_folder(path.parent)
    except OSError as error:
        raise RecordingWriteError(path, _words(error)) from error
    finally:
        if not complete and not keep_part:
            part.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Name of the unfinished file."""
    return path.with_name(path.name + PART_SUFFIX)


def open_locked(path: Path, busy: str) -> BinaryIO:
    """Opens a file for reading and writing, creates it if it is missing, and locks it.

    Args:
        path: The file.
        busy: Message if another process has locked it.

    Raises:
        RecordingBusyError: If another process has locked it.
        OSError: If it cannot be opened.
    """
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0)
    stream = os.fdopen(os.open(path, flags, 0o666), "r+b")
    # Without locks in the file system, only one service per folder prevents conflicts.
    with suppress(OSError):
        if not try_lock(stream):
            stream.close()
            raise RecordingBusyError(path, busy)
    return stream


def lock_in_place(stream: BinaryIO, path: Path) -> bool:
    """Locks an open file; False if it is locked, renamed or deleted by another process.

    Raises:
        OSError: If the file system has no locks.
    """
    return try_lock(stream) and _is_in_place(stream, path)


def _is_in_place(stream: BinaryIO, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.lstat())
    except FileNotFoundError:
        return False


def _remove_remains(part: Path) -> None:
    """Deletes the unfinished file of a killed process, unless it is the recording of a run."""
    if part.name.endswith(RECORDING_PART) or part.is_symlink() or not part.exists():
        return
    with part.open("rb") as stream:
        if lock_in_place(stream, part):
            part.unlink()


def _create(part: Path) -> BinaryIO:
    """Opens a new file and locks it."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    while True:
        stream = os.fdopen(os.open(part, flags, 0o666), "wb")
        # Without locks in the file system, only the name prevents conflicts.
        with suppress(OSError):
            while not try_lock(stream):
                time.sleep(_POLL)
        if _is_in_place(stream, part):
            return stream
        stream.close()  # recovery deleted it, because it was empty and not yet locked


def _words_for_existing(part: Path) -> str:
    with part.open("rb") as stream:
        if not try_lock(stream):
            return f"another run is writing '{part.name}'"
    return (
        f"'{part.name}' is the unfinished recording of a run that was killed; recover its content "
        f"with 'slipgrasp recover', or delete it"
    )


def sync_folder(folder: Path) -> None:
    """Makes a rename durable; only possible on POSIX systems."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _words(error: OSError) -> str:
    return error.strerror or type(error).__name__
