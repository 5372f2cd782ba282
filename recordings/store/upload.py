"""A recording that comes in piece by piece, from someone who may send anything."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import RecordingError, RecordingWriteError, UploadError
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.storage_limits import StorageLimits

UPLOAD_SUFFIX = ".upload.part"
"""Not that of runs: what is left of an upload is of no use to anyone."""

CHECK_BYTES = 1 << 24


class Upload:
    """Takes the bytes of a recording; leaving its ``with`` block early leaves nothing behind.

    Args:
        path: Where the recording goes once it is whole and was read without fault.
        limits: How much there may be.
    """

    def __init__(self, path: Path, limits: StorageLimits) -> None:
        self._path = path
        self._limits = limits
        self._stack = ExitStack()
        self._unchecked = 0

    def __enter__(self) -> Self:
        file = atomic_file(self._path, overwrite=False, part_suffix=UPLOAD_SUFFIX)
        self._stream = self._stack.enter_context(file)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, traceback)

    def write(self, piece: bytes) -> None:
        """Takes the next bytes.

        Raises:
            StorageFullError: If there is no room for them.
            RecordingWriteError: If the disk fails.
        """
        self._unchecked += len(piece)
        if self._unchecked >= CHECK_BYTES:
            self._limits.check(self._path.parent, len(piece))
            self._unchecked = 0
        try:
            self._stream.write(piece)
        except OSError as error:
            raise RecordingWriteError(self._path, error.strerror or "disk error") from error

    def finish(self) -> RunResult:
        """Reads what came, and gives the file its name.

        Raises:
            UploadError: If it is no whole recording that this program can read.
            StorageFullError: If there is no room for it.
            RecordingWriteError: If the disk fails.
        """
        part = self._path.with_name(self._path.name + UPLOAD_SUFFIX)
        try:
            self._stream.flush()
        except OSError as error:
            raise RecordingWriteError(self._path, error.strerror or "disk error") from error
        self._limits.check(self._path.parent)
        try:
            result = read_recording(part)
            Description.from_result(result)
        except RecordingError as error:
            raise UploadError(str(error).replace(str(part), "upload")) from error
        self._stack.close()
        return result
