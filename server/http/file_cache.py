"""Cache of files that are created on demand."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from tempfile import gettempdir, mkstemp
from threading import Lock, Semaphore
from typing import BinaryIO

from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.server.exceptions import ServiceBusyError

MAX_BYTES = 500_000_000
MAX_FILES = 256

PATIENCE = 10.0
"""Waiting time for another slow file [s]."""
MAX_WAITING = 16
"""Number of requests that may wait: each occupies a thread."""


class FileCache:
    """Caches recent files, so that one that is read range by range is created once.

    Args:
        max_bytes: Total size; a larger file is created every time.
        max_files: Number of files.
    """

    def __init__(self, max_bytes: int = MAX_BYTES, max_files: int = MAX_FILES) -> None:
        self._max_bytes = max_bytes
        self._max_files = max_files
        self._files: OrderedDict[str, tuple[Path, int]] = OrderedDict()
        self._lock = Lock()
        self._long_turn = Lock()
        self._places = Semaphore(MAX_WAITING)

    def open(
        self, tag: str, write: Callable[[BinaryIO], object], *, takes_long: bool = False
    ) -> BinaryIO:
        """Opens a file, creating it if missing; thread-safe.

        Args:
            tag: Key that is equal for equal files.
            write: Writes it to a seekable stream.
            takes_long: Whether to create it only when no other such file is being created, so that
                several do not occupy all processors, and repeated requests create it once.

        Raises:
            RecordingWriteError: If there is no space for it.
            ServiceBusyError: If another slow file is not finished in time.
        """
        if (known := self._open_known(tag)) is not None:
            return known
        with self._turn() if takes_long else nullcontext():
            # A request that waited may find the file.
            return self._open_known(tag) or self._make_and_keep(tag, write)

    @contextmanager
    def _turn(self) -> Iterator[None]:
        with ExitStack() as stack:
            for gate, patience in ((self._places, 0.0), (self._long_turn, PATIENCE)):
                if not gate.acquire(timeout=patience):
                    raise ServiceBusyError("another long table is being written")
                stack.callback(gate.release)
            yield

    def close(self) -> None:
        """Deletes all files, and keeps no more."""
        with self._lock:
            self._max_files = 0
            self._drop_oldest()

    def _open_known(self, tag: str) -> BinaryIO | None:
        """A cached file, if it still exists; temporary files may be deleted by the system."""
        with self._lock:
            if tag not in self._files:
                return None
            self._files.move_to_end(tag)
            try:
                return self._files[tag][0].open("rb")
            except FileNotFoundError:
                del self._files[tag]
                return None

    def _make_and_keep(self, tag: str, write: Callable[[BinaryIO], object]) -> BinaryIO:
        path = _make(write)
        file = path.open("rb")
        with self._lock:
            # Two requests may have created the same file; the later one is kept.
            self._drop(tag)
            self._files[tag] = path, os.fstat(file.fileno()).st_size
            self._drop_oldest()
        return file

    def _drop_oldest(self) -> None:
        while (
            sum(size for _, size in self._files.values()) > self._max_bytes
            or len(self._files) > self._max_files
        ):
            self._drop(next(iter(self._files)))

    def _drop(self, tag: str) -> None:
        if tag in self._files:
            path, _ = self._files.pop(tag)
            path.unlink(missing_ok=True)


def _make(write: Callable[[BinaryIO], object]) -> Path:
    with ExitStack() as on_failure:
        try:
            descriptor, name = mkstemp(prefix="slipgrasp-")
            on_failure.callback(Path(name).unlink, missing_ok=True)
            with os.fdopen(descriptor, "wb+") as stream:
                write(stream)
        except OSError as error:
            raise RecordingWriteError(Path(gettempdir()), error.strerror or "no space") from error
        on_failure.pop_all()
    return Path(name)
