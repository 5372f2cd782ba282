"""Files of a data folder: ``ID.mcap`` is a run, ``ID.json`` its description and annotations.

The recordings define which runs exist. A sidecar contains data outside the recording, so that equal
runs give equal files (creation time, name, notes and tags), and a description for lists; if the
sidecar is missing or unusable, or belongs to another file, the recording is read instead.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import blake2b
from pathlib import Path
from stat import S_ISREG
from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.exceptions import (
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
    told_within,
)
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.file.documents import parse_json
from slipgrasp.recordings.file.pieces import read_ending
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.measured.recording import is_measured, read_outline
from slipgrasp.recordings.store.annotations import Annotations, usable_part
from slipgrasp.recordings.store.description import Description
from slipgrasp.recordings.store.identifiers import ID
from slipgrasp.recordings.store.stored_run import StoredRun

MAX_SIDECAR_BYTES = 1 << 25
DIGEST_BYTES = 12
MOST_DESCRIBED_WHOLE = 100_000
"""Largest number of samples of a recording that is read completely for its description."""

_FILES_PER_PAUSE = 1000

_HALF_PAIR = re.compile(rb"\\u[dD][89a-fA-F]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sidecar:
    """The usable content of a sidecar.

    Attributes:
        created: Time at which the run was saved, ISO 8601 in UTC; None if missing.
        description: The description; None if it is incomplete.
        annotations: Annotations by users.
    """

    created: str | None
    description: Description | None
    annotations: Annotations


class RunFiles:
    """The runs of a folder, each read from its own files.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def recording(self, run_id: str) -> Path:
        """Path of the recording of a run."""
        return self.path / f"{run_id}.mcap"

    def sidecar(self, run_id: str) -> Path:
        """Path of the sidecar of a run."""
        return self.path / f"{run_id}.json"

    def holds(self, run_id: str) -> bool:
        """Whether a run exists; ids never refer to files outside the folder."""
        if not ID.fullmatch(run_id):
            return False
        path = self.recording(run_id)
        return path.is_file() and not path.is_symlink()

    def scan(self, pause: Callable[[], None] = lambda: None) -> dict[str, int]:
        """The stamp of every run.

        Args:
            pause: Called every thousand files.
        """
        stamps: dict[str, dict[str, int]] = {"mcap": {}, "json": {}}
        try:
            with os.scandir(self.path) as entries:
                for number, entry in enumerate(entries):
                    if number % _FILES_PER_PAUSE == 0:
                        pause()
                    run_id, _, kind = entry.name.partition(".")
                    if kind in stamps and ID.fullmatch(run_id):
                        stamps[kind][run_id] = _stamp(entry)
        except (FileNotFoundError, NotADirectoryError):
            return {}
        found, sidecars = stamps["mcap"], stamps["json"]
        for run_id in [run_id for run_id, stamp in found.items() if not stamp]:
            del found[run_id]
        for run_id in found:
            found[run_id] = _joint_stamp(found[run_id], sidecars.get(run_id, 0))
        return found

    def stamp(self, run_id: str) -> int | None:
        """The stamp of a run, which changes with its files; None if the run does not exist."""
        recording = _stamp(self.recording(run_id))
        return _joint_stamp(recording, _stamp(self.sidecar(run_id))) if recording else None

    def read(self, run_id: str) -> StoredRun:
        """Describes a run from its sidecar if possible.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        sidecar = self.read_sidecar(run_id)
        description = sidecar.description or self.describe(run_id)
        return self.put_together(run_id, sidecar, description)

    def put_together(self, run_id: str, sidecar: Sidecar, description: Description) -> StoredRun:
        """Describes a run from known data.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        path = self.recording(run_id)
        try:
            status = path.stat()
        except FileNotFoundError:
            raise RecordingNotFoundError(run_id) from None
        return StoredRun(
            id=run_id,
            path=path,
            created=sidecar.created or time_of(status),
            size=status.st_size,
            title=description.title,
            summary=description.summary,
            preset=description.preset,
            controller=description.controller,
            name=sidecar.annotations.name,
            notes=sidecar.annotations.notes,
            tags=sidecar.annotations.tags,
        )

    def describe(self, run_id: str) -> Description:
        """Describes a run from its recording; a damaged one with the reason.

        Raises:
            RecordingNotFoundError: If it does not exist.
        """
        path = self.recording(run_id)
        try:
            if is_measured(path):
                return Description.from_measured(read_outline(path))
            return Description.from_result(_read_to_describe(path))
        except RecordingNotFoundError:
            raise RecordingNotFoundError(run_id) from None
        except RecordingError as error:
            return Description(title=told_within(error, self.path), controller="", summary={})

    def read_sidecar(self, run_id: str) -> Sidecar:
        """The usable content of the sidecar, which may be missing or damaged."""
        document = read_document(self.sidecar(run_id))
        description: Description | None
        try:
            description = Description.from_document(document)
        except (ArithmeticError, KeyError, TypeError, ValueError):
            description = None
        if description and document.get("digest") != _digest(description, self._size(run_id)):
            description = None
        return Sidecar(
            created=checked_time(document.get("created")),
            description=description,
            annotations=usable_part(document),
        )

    def write_sidecar(self, stored: StoredRun) -> None:
        """Writes the sidecar of a run.

        Raises:
            RecordingWriteError: If it cannot be written; the old one is then unchanged.
        """
        text = sidecar_text(stored)
        if len(text) > MAX_SIDECAR_BYTES:
            cause = f"its phase changes and texts take more than {MAX_SIDECAR_BYTES} bytes"
            raise RecordingWriteError(self.sidecar(stored.id), cause)
        with atomic_file(self.sidecar(stored.id), overwrite=True) as stream:
            stream.write(text)

    def _size(self, run_id: str) -> int:
        """Size of a recording [bytes]; 0 if it does not exist."""
        try:
            return self.recording(run_id).stat().st_size
        except FileNotFoundError:
            return 0

    def delete(self, run_id: str) -> None:
        """Deletes the files of a run.

        Raises:
            RecordingNotFoundError: If it does not exist.
            RecordingError: If it cannot be deleted.
        """
        try:
            self.recording(run_id).unlink()
            self.sidecar(run_id).unlink(missing_ok=True)
        except FileNotFoundError:
            raise RecordingNotFoundError(run_id) from None
        except OSError as error:
            path = self.recording(run_id)
            raise RecordingError(f"cannot delete '{path}': {error.strerror}") from error


def _read_to_describe(path: Path) -> RunResult:
    """Reads a run; a long one without samples, in which case its statements are not checked."""
    size = read_size(path)
    is_long = size.samples > MOST_DESCRIBED_WHOLE and size.has_all_metrics
    return read_ending(path) if is_long else read_recording(path)


def sidecar_text(stored: StoredRun) -> bytes:
    """The sidecar of a run, as JSON."""
    document = {
        "created": stored.created,
        "title": stored.title,
        "controller": stored.controller,
        "name": stored.name,
        "notes": stored.notes,
        "tags": stored.tags,
        "summary": stored.summary,
        "digest": _digest(stored, stored.size),
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1).encode()


def _digest(run: Description | StoredRun, size: int) -> str:
    """Checksum of a description together with the size of its recording."""
    text = json.dumps([run.title, run.controller, run.summary, size], sort_keys=True)
    return blake2b(text.encode(), digest_size=DIGEST_BYTES).hexdigest()


def iso_time(time: datetime) -> str:
    """ISO 8601 in UTC, to the millisecond."""
    return time.astimezone(UTC).isoformat(timespec="milliseconds")


def _stamp(file: os.DirEntry[str] | Path) -> int:
    """Stamp of one file; 0 if it does not exist or is a link."""
    try:
        status = file.stat(follow_symlinks=False)
    except OSError:
        return 0
    if not S_ISREG(status.st_mode):
        return 0
    facts = (status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino)
    return hash(facts) or 1  # a hash of integers, which is the same in every process


def _joint_stamp(recording: int, sidecar: int) -> int:
    """Combined stamp of both files of a run, as an SQLite integer."""
    return hash((recording, sidecar)) % (1 << 63)


def time_of(status: os.stat_result) -> str:
    """Modification time of a file; 1970 if it is not a valid date."""
    try:
        return iso_time(datetime.fromtimestamp(status.st_mtime, UTC))
    except (OSError, OverflowError, ValueError):
        return iso_time(datetime.fromtimestamp(0.0, UTC))


def read_document(path: Path) -> Mapping[str, Any]:
    """Reads a JSON object; empty if missing or unusable."""
    try:
        status = path.lstat()
        if not S_ISREG(status.st_mode) or status.st_size > MAX_SIDECAR_BYTES:
            return {}
        text = path.read_bytes()
        document = parse_json(text.decode("utf-8"))
        if _HALF_PAIR.search(text):
            json.dumps(document, ensure_ascii=False).encode()
    except (OSError, ValueError):
        return {}
    return document if isinstance(document, dict) else {}


def checked_time(value: object) -> str | None:
    """Parses a time from `iso_time`; None if invalid."""
    if not isinstance(value, str):
        return None
    try:
        time = datetime.fromisoformat(value)
        return iso_time(time if time.tzinfo else time.replace(tzinfo=UTC))
    except (ValueError, OverflowError):
        return None
