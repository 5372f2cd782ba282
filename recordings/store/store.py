"""The folder of stored runs: one recording and one sidecar per run.

The recordings define which runs exist; see `slipgrasp.recordings.store.run_files`. Searches use
`slipgrasp.recordings.store.run_index`.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Collection, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryFile
from threading import Lock
from typing import Any, Self

import platformdirs

from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.run.claims import contradictions_of
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import (
    ContradictoryRecordingError,
    RecordingChangedError,
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
    UploadError,
)
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.size import RecordingSize, read_size
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.measured.recording import MeasuredOutline
from slipgrasp.recordings.store.annotations import Annotations
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.identifiers import IdSource
from slipgrasp.recordings.store.run_files import RunFiles, Sidecar, iso_time
from slipgrasp.recordings.store.run_index import FoundRuns, RunIndex
from slipgrasp.recordings.store.run_query import RunQuery
from slipgrasp.recordings.store.storage_limits import StorageLimits
from slipgrasp.recordings.store.stored_run import StoredRun

DATA_VARIABLE = "SLIPGRASP_DATA"
UPLOAD_SUFFIX = ".upload.part"
"""Suffix of an unfinished upload; unlike an unfinished run, it cannot be recovered."""

SIDECAR_PART = ".json.part"
"""Suffix of an unfinished sidecar; the recording and the previous sidecar have all it contains."""

CHECK_BYTES = 1 << 24

READ_SECONDS = 30.0
READ_SECONDS_PER_BYTE = 1e-6
"""Time limits for reading an upload [s] and per byte [s]; a slow machine needs a tenth."""
PROBE_BYTES = 4096

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Reservation:
    """A reserved place for a run.

    Attributes:
        id: The run's name in the store.
        path: The path of its recording.
    """

    id: str
    path: Path


def default_data_directory() -> Path:
    """The data folder: ``SLIPGRASP_DATA`` if set, else the platform's folder for data."""
    chosen = os.environ.get(DATA_VARIABLE)
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("slipgrasp", False))


class RecordingStore:
    """Stores runs in a folder; safe to use from several threads.

    Args:
        folder: The folder; created with the first run.
        limits: Limits of its size.
    """

    def __init__(self, folder: Path, limits: StorageLimits | None = None) -> None:
        self._files = RunFiles(folder)
        self._index = RunIndex(self._files)
        self._limits = limits or StorageLimits()
        self._ids = IdSource()
        self._change_lock = Lock()

    def prepare(self) -> None:
        """Creates the folder if it is missing, readable by its owner alone.

        Raises:
            RecordingWriteError: If nothing can be saved there.
        """
        folder = self._files.path
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingWriteError(folder, error.strerror or "no folder") from error
        if not os.access(folder, os.W_OK | os.X_OK):
            raise RecordingWriteError(folder, "no permission to write in this folder")

    def close(self) -> None:
        """Closes open files; the store can still be used."""
        self._index.close()

    def reserve(self, incoming: int = 0, *, run_id: str | None = None) -> Reservation:
        """Reserves a place for a run, before it is simulated or sent.

        Args:
            incoming: Bytes of its recording, as far as known.
            run_id: An id from `new_id`, if it has one already.

        Raises:
            RecordingWriteError: If nothing can be saved.
            StorageFullError: If there is no space.
        """
        self.check_space(incoming)
        run_id = run_id or self.new_id()
        return Reservation(run_id, self._files.recording(run_id))

    def check_space(self, incoming: int = 0) -> None:
        """Checks whether another run can be stored; raises the errors of `reserve`."""
        self.prepare()
        self._limits.check(self._files.path, incoming)

    def check_writable(self) -> None:
        """Writes some bytes as a test; raises the errors of `reserve`.

        Permissions do not show whether a disk has failed, or has been remounted read-only.
        """
        self.check_space()
        try:
            with TemporaryFile(dir=self._files.path) as probe:
                probe.write(bytes(PROBE_BYTES))
        except OSError as error:
            raise RecordingWriteError(self._files.path, error.strerror or "disk error") from error

    def register(
        self, reservation: Reservation, result: RunResult, annotations: Annotations | None = None
    ) -> StoredRun:
        """Registers a run whose recording is at its reserved path.

        If the sidecar cannot be written the run is still stored, and its recording describes
        it. A run's stated results are checked against its samples on reading, also for an
        `Upload`.

        Args:
            reservation: The place.
            result: The run; its last samples suffice.
            annotations: Its name, notes and tags.

        Raises:
            RecordingNotFoundError: If its recording was not written, or is gone.
        """
        description = Description.from_result(result)
        return self._describe(reservation, description, annotations or Annotations())

    def register_measured(self, reservation: Reservation, outline: MeasuredOutline) -> StoredRun:
        """Registers measured data whose recording is at its reserved path; see `register`."""
        annotations = Annotations.checked({"name": outline.title})
        return self._describe(reservation, Description.from_measured(outline), annotations)

    def _describe(
        self, reservation: Reservation, description: Description, annotations: Annotations
    ) -> StoredRun:
        created = iso_time(datetime.now(UTC))
        sidecar = Sidecar(created=created, description=description, annotations=annotations)
        stored = self._files.put_together(reservation.id, sidecar, description)
        try:
            self._files.write_sidecar(stored)
        except RecordingWriteError as error:
            _logger.warning("run %s is stored without its sidecar: %s", stored.id, error)
        self._index.note(stored.id)
        return stored

    def save(self, result: RunResult) -> StoredRun:
        """Stores a run.

        Raises:
            ContradictoryRecordingError: If its stated results contradict its samples.
            RecordingWriteError: If it cannot be written; nothing of it remains.
            StorageFullError: If there is no space.
        """
        reservation = self.reserve()
        if found := contradictions_of(result):
            raise ContradictoryRecordingError(str(reservation.path), found)
        write_recording(result, reservation.path)
        return self.register(reservation, result)

    def keep(
        self, run_id: str, data: bytes, description: Description, annotations: Annotations
    ) -> StoredRun:
        """Stores a recording from elsewhere; it replaces one with the same id.

        Args:
            run_id: Its id.
            data: The bytes of the file, as `write_recording` makes them.
            description: The description of the run.
            annotations: Its name, notes and tags.

        Raises:
            RecordingWriteError: If a file cannot be written.
            StorageFullError: If there is no space.
        """
        reservation = self.reserve(len(data), run_id=run_id)
        with atomic_file(reservation.path, overwrite=True) as stream:
            stream.write(data)
        return self._describe(reservation, description, annotations)

    def upload(self, reservation: Reservation) -> Upload:
        """An upload of a recording; `register` it once it is finished."""
        return Upload(reservation.path, self._limits)

    def discard_unfinished(self, unfinished: Iterable[Path]) -> None:
        """Deletes the unfinished uploads and sidecars of a killed service.

        Args:
            unfinished: All unfinished files in the folder.
        """
        for part in unfinished:
            if not part.name.endswith((UPLOAD_SUFFIX, SIDECAR_PART)):
                continue
            try:
                if not part.is_symlink() and not _is_being_written(part):
                    part.unlink()
            except OSError as error:
                _logger.warning("'%s' could not be deleted: %s", part, error.strerror)

    def list(self, offset: int = 0, limit: int | None = None) -> list[StoredRun]:
        """The runs, newest first.

        Args:
            offset: Number of the newest runs to skip.
            limit: Largest number of runs; all if None.
        """
        return self.find(RunQuery(offset=offset, limit=limit)).runs

    def find(self, query: RunQuery) -> FoundRuns:
        """The runs of a search, and their total number."""
        return self._index.find(query)

    def begin_listing(self) -> None:
        """Starts indexing the folder, to shorten the wait for the first search."""
        self._index.begin()

    def note(self, run_id: str) -> None:
        """Lists a run whose files another process has written."""
        self._index.note(run_id)

    def count(self) -> int:
        """The number of runs, counted from the files."""
        return len(self._files.scan())

    def get(self, run_id: str) -> StoredRun:
        """One run by its id.

        Raises:
            RecordingNotFoundError: If no stored run has this id, which may be any text.
        """
        if not self._files.holds(run_id):
            raise RecordingNotFoundError(run_id)
        return self._files.read(run_id)

    def open(self, run_id: str) -> RunResult:
        """Reads a run back.

        Raises:
            RecordingNotFoundError: If it does not exist.
            RecordingError: If its file is damaged.
        """
        return read_recording(self.get(run_id).path)

    def annotate(
        self,
        run_id: str,
        *,
        name: str | None = None,
        notes: str | None = None,
        tags: Sequence[str] | None = None,
        expected: Collection[str] | None = None,
    ) -> StoredRun:
        """Changes the annotations of a run; None leaves a value unchanged.

        Args:
            run_id: The run.
            name: At most 200 printable characters.
            notes: At most 10 000 characters.
            tags: At most 32 of at most 64 printable characters.
            expected: Revisions for which the change is made; any if None.

        Returns:
            The run with its new description.

        Raises:
            RecordingNotFoundError: If it does not exist.
            AnnotationError: If name, notes or tags are beyond their bounds.
            RecordingChangedError: If the run's revision is not an expected one.
            RecordingWriteError: If it cannot be written; then nothing has changed.
        """
        given = {"name": name, "notes": notes, "tags": tags}
        changes = {key: value for key, value in given.items() if value is not None}
        checked = Annotations.checked(changes)
        with self._change_lock:
            stored = self.get(run_id)
            if expected is not None and stored.revision not in expected:
                raise RecordingChangedError(run_id)
            changed = replace(stored, **{key: getattr(checked, key) for key in changes})
            self._files.write_sidecar(changed)
        self._index.note(run_id)
        return changed

    def delete(self, run_id: str, *, expected: Collection[str] | None = None) -> None:
        """Deletes a run permanently.

        Args:
            run_id: The run.
            expected: Revisions for which it is deleted; any if None.

        Raises:
            RecordingNotFoundError: If it does not exist.
            RecordingChangedError: If the run's revision is not an expected one.
            RecordingError: If it cannot be deleted.
        """
        with self._change_lock:
            if not self._files.holds(run_id):
                raise RecordingNotFoundError(run_id)
            if expected is not None and self._files.read(run_id).revision not in expected:
                raise RecordingChangedError(run_id)
            self._files.delete(run_id)
        self._index.note(run_id)

    def new_id(self) -> str:
        """An id that sorts after all earlier ids of this store."""
        return self._ids.new(datetime.now(UTC))


class Upload:
    """Receives the bytes of a recording; an error before the end of `finish` deletes them.

    Args:
        path: The path of the recording once it is complete and has been read without error.
        limits: Limits of the size of the folder.
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

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    def write(self, piece: bytes) -> None:
        """Receives the next bytes.

        Raises:
            StorageFullError: If there is no space for them.
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

    def read_size(self) -> RecordingSize:
        """The memory that the run needs according to its file.

        Raises:
            UploadError: If it is not a recording that this program can read.
            RecordingWriteError: If the disk fails.
        """
        part = self._flushed()
        try:
            return read_size(part)
        except RecordingError as error:
            raise _told_of_upload(error, part) from error

    def finish(self) -> RunResult:
        """Reads the upload, and renames the file.

        Raises:
            UploadError: If it is not a complete recording that this program can read, or exceeds
                the time limit of reading.
            StorageFullError: If there is no space for it.
            RecordingWriteError: If the disk fails.
        """
        part = self._flushed()
        self._limits.check(self._path.parent)
        allowed = READ_SECONDS + READ_SECONDS_PER_BYTE * part.stat().st_size
        end = time.monotonic() + allowed
        try:
            result = read_recording(part, should_stop=lambda: time.monotonic() > end)
            Description.from_result(result)
        except RecordingError as error:
            if time.monotonic() > end:
                told = f"reading the upload takes more than {allowed:.3g} s, the limit for its size"
                raise UploadError(told) from error
            raise _told_of_upload(error, part) from error
        self._stack.close()
        return result

    def _flushed(self) -> Path:
        """The upload as a readable file."""
        try:
            self._stream.flush()
        except OSError as error:
            raise RecordingWriteError(self._path, error.strerror or "disk error") from error
        return self._path.with_name(self._path.name + UPLOAD_SUFFIX)


def _told_of_upload(error: RecordingError, part: Path) -> UploadError:
    return UploadError(str(error).replace(str(part), "upload"))


def _is_being_written(path: Path) -> bool:
    with path.open("rb") as stream:
        return not try_lock(stream)
