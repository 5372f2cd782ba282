"""Files that are made when they are asked for, and kept for a while."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory, mkstemp
from threading import Lock
from typing import Annotated, BinaryIO

from fastapi import Depends, Request

from recordings.exceptions import RecordingWriteError

__all__ = ["MadeFiles", "MadeFilesDep"]

MAX_BYTES = 500_000_000


class MadeFiles:
    """Keeps the files made last, so that one that is read range by range is made once.

    Args:
        max_bytes: How much they may take together; a larger one is made every time.
    """

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._folder: TemporaryDirectory[str] | None = None
        self._files: OrderedDict[str, tuple[Path, int]] = OrderedDict()
        self._lock = Lock()

    def open(self, tag: str, write: Callable[[BinaryIO], object]) -> BinaryIO:
        """Opens a file, making it if it is not there; safe to call from several threads.

        Args:
            tag: The same for files with the same bytes.
            write: Writes it to a stream that is seekable.

        Raises:
            RecordingWriteError: If there is no room for it.
        """
        with self._lock:
            if tag in self._files:
                self._files.move_to_end(tag)
                return self._files[tag][0].open("rb")
            if self._folder is None:
                self._folder = TemporaryDirectory(prefix="slipgrasp-")
            folder = Path(self._folder.name)
        path = _make(folder, write)
        file = path.open("rb")
        with self._lock:
            self._keep(tag, path)
        return file

    def close(self) -> None:
        """Deletes all of them."""
        with self._lock:
            self._files.clear()
            if self._folder is not None:
                self._folder.cleanup()
                self._folder = None

    def _keep(self, tag: str, path: Path) -> None:
        """Two may have made the same at once; then the later one stays."""
        self._drop(tag)
        self._files[tag] = path, path.stat().st_size
        while sum(size for _, size in self._files.values()) > self._max_bytes:
            self._drop(next(iter(self._files)))

    def _drop(self, tag: str) -> None:
        if tag in self._files:
            path, _ = self._files.pop(tag)
            path.unlink(missing_ok=True)


def _make(folder: Path, write: Callable[[BinaryIO], object]) -> Path:
    with ExitStack() as on_failure:
        try:
            descriptor, name = mkstemp(dir=folder)
            on_failure.callback(Path(name).unlink, missing_ok=True)
            with os.fdopen(descriptor, "wb+") as stream:
                write(stream)
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "no room") from error
        on_failure.pop_all()
    return Path(name)


def _made_files(request: Request) -> MadeFiles:
    made: MadeFiles = request.app.state.made_files
    return made


MadeFilesDep = Annotated[MadeFiles, Depends(_made_files)]
