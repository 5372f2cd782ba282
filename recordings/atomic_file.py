"""Files that appear complete or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from recordings.exceptions import RecordingExistsError, RecordingWriteError

__all__ = ["atomic_file"]

PART_SUFFIX = ".part"


@contextmanager
def atomic_file(path: Path, *, overwrite: bool) -> Iterator[BinaryIO]:
    """Opens a new file that takes its name only once it is complete and on disk.

    It grows as ``NAME.part``, which also keeps two writers of one file apart. After an
    error nothing is left behind and a file that was there before is untouched.

    Args:
        path: Final name of the file.
        overwrite: Whether an existing file is replaced.

    Yields:
        The stream to write to.

    Raises:
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingWriteError: If the disk or its permissions do not allow it.
    """
    part = path.with_name(path.name + PART_SUFFIX)
    if not overwrite and path.exists():
        raise RecordingExistsError(path)
    try:
        stream = _create(part)
    except FileExistsError:
        cause = f"'{part.name}' exists; delete it unless another run is writing it right now"
        raise RecordingWriteError(path, cause) from None
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
        part.replace(path)
        complete = True
        _sync_folder(path.parent)
    except OSError as error:
        raise RecordingWriteError(path, _words(error)) from error
    finally:
        if not complete:
            part.unlink(missing_ok=True)


def _create(part: Path) -> BinaryIO:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    return os.fdopen(os.open(part, flags, 0o666), "wb")


def _sync_folder(folder: Path) -> None:
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
