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
    """Opens a new file that takes its name only once it is complete and on disk.

    It grows as ``NAME.part``, locked as long as this process writes it, which also keeps
    two writers of one file apart. What a killed process left of it is replaced, but for a
    recording. After an error a file that was there before is untouched.

    Args:
        path: Final name of the file.
        overwrite: Whether an existing file is replaced.
        part_suffix: What the growing file's name ends with.
        keep_part: Whether an error leaves what was written so far, to be recovered.
        publish: Gives the part, which is complete and on disk, the final name.

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
    """What a file is called while it grows."""
    return path.with_name(path.name + PART_SUFFIX)


def lock_in_place(stream: BinaryIO, path: Path) -> bool:
    """Locks an open file; False if another process holds it, or its name is gone or given anew.

    Raises:
        OSError: If its file system has no locks.
    """
    return try_lock(stream) and _is_in_place(stream, path)


def _is_in_place(stream: BinaryIO, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.lstat())
    except FileNotFoundError:
        return False


def _remove_remains(part: Path) -> None:
    """Removes what a killed process left of a file that can be made again; a run cannot."""
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
        # Where the file system has no locks, the name alone keeps writers apart.
        with suppress(OSError):
            while not try_lock(stream):
                time.sleep(_POLL)
        if _is_in_place(stream, part):
            return stream
        stream.close()  # recovery found it empty, not yet locked, and deleted it


def _words_for_existing(part: Path) -> str:
    with part.open("rb") as stream:
        if not try_lock(stream):
            return f"another run is writing '{part.name}' right now"
    return (
        f"'{part.name}' is left of a run that was killed; keep what it holds with "
        f"'slipgrasp recover', or delete it"
    )


def sync_folder(folder: Path) -> None:
    """Makes the new name itself survive a power cut; only POSIX systems can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _words(error: OSError) -> str:
    return error.strerror or type(error).__name__
