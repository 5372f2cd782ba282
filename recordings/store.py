"""The folder where runs are kept: one recording and one sidecar per run.

What the recording must not hold, so that equal runs are equal files, lies beside it in
``ID.json``: when it was made, and title and summary for lists. The recordings alone say
what there is; a sidecar that is missing or unreadable is derived from its recording.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import string
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import Any

import platformdirs

from core.result import RunResult
from recordings.atomic_file import atomic_file
from recordings.exceptions import RecordingError, RecordingNotFoundError, RecordingWriteError
from recordings.reader import read_recording
from recordings.writer import write_recording

__all__ = ["RecordingStore", "StoredRun", "default_data_directory"]

DATA_VARIABLE = "SLIPGRASP_DATA"

_ID = re.compile(r"[a-z0-9]{12}")
_DIGITS = string.digits + string.ascii_lowercase
_TIME_DIGITS = 8
_RANDOM_DIGITS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRun:
    """A run in the store.

    Attributes:
        id: Its name in the store, twelve letters and digits.
        path: Its recording.
        created: When it was saved, ISO 8601 in UTC.
        title: Title of its scenario.
        summary: The run without its trace (`RunResult.summary`).
    """

    id: str
    path: Path
    created: str
    title: str
    summary: dict[str, Any]


def default_data_directory() -> Path:
    """Where runs are kept: ``SLIPGRASP_DATA`` if set, else the platform's folder for data."""
    chosen = os.environ.get(DATA_VARIABLE)
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("slipgrasp", False))


class RecordingStore:
    """Keeps runs in a folder; safe to use from several threads.

    Args:
        folder: The folder; made with the first run.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._last_stamp = 0
        self._lock = Lock()

    def prepare(self) -> None:
        """Makes the folder if it is missing.

        Raises:
            RecordingWriteError: If nothing can be saved there.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingWriteError(self._folder, error.strerror or "no folder") from error
        if not os.access(self._folder, os.W_OK | os.X_OK):
            raise RecordingWriteError(self._folder, "no permission to write in this folder")

    def save(self, result: RunResult) -> StoredRun:
        """Keeps a run.

        Raises:
            RecordingWriteError: If it cannot be written; then nothing of it is left.
        """
        self.prepare()
        now = datetime.now(UTC)
        run_id = self._new_id(now)
        stored = StoredRun(
            id=run_id,
            path=self._recording_path(run_id),
            created=now.isoformat(timespec="milliseconds"),
            title=result.scenario.title,
            summary=_plain_summary(result),
        )
        write_recording(result, stored.path)
        try:
            self._write_sidecar(stored)
        except RecordingWriteError:
            stored.path.unlink(missing_ok=True)
            raise
        return stored

    def list(self, offset: int = 0, limit: int | None = None) -> list[StoredRun]:
        """The runs, newest first; only the sidecars of those returned are read.

        Args:
            offset: How many of the newest to leave out.
            limit: How many to return at most; all if None.
        """
        ids = self._ids()[offset:]
        return [self._stored(run_id) for run_id in (ids if limit is None else ids[:limit])]

    def count(self) -> int:
        """How many runs there are."""
        return len(self._ids())

    def get(self, run_id: str) -> StoredRun:
        """One run by its id.

        Raises:
            RecordingNotFoundError: If there is none, whatever the id looks like.
        """
        if not _ID.fullmatch(run_id) or not _is_file(self._recording_path(run_id)):
            raise RecordingNotFoundError(run_id)
        return self._stored(run_id)

    def open(self, run_id: str) -> RunResult:
        """Reads a run back.

        Raises:
            RecordingNotFoundError: If there is none.
            RecordingError: If its file is damaged.
        """
        return read_recording(self.get(run_id).path)

    def delete(self, run_id: str) -> None:
        """Removes a run for good.

        Raises:
            RecordingNotFoundError: If there is none.
        """
        path = self.get(run_id).path
        path.unlink(missing_ok=True)
        self._sidecar_path(run_id).unlink(missing_ok=True)

    def _ids(self) -> list[str]:
        """Ids of all runs, newest first: they begin with the time they were made."""
        if not self._folder.is_dir():
            return []
        with os.scandir(self._folder) as entries:
            names = [e.name for e in entries if e.is_file(follow_symlinks=False)]
        ids = [name[: -len(".mcap")] for name in names if name.endswith(".mcap")]
        return sorted(filter(_ID.fullmatch, ids), reverse=True)

    def _new_id(self, now: datetime) -> str:
        """An id that sorts after all that this store has made before."""
        with self._lock:
            self._last_stamp = max(self._last_stamp + 1, int(now.timestamp() * 1000))
            stamp = self._last_stamp
        digits = []
        for _ in range(_TIME_DIGITS):
            stamp, digit = divmod(stamp, len(_DIGITS))
            digits.append(_DIGITS[digit])
        random = [secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS)]
        return "".join([*reversed(digits), *random])

    def _stored(self, run_id: str) -> StoredRun:
        path = self._recording_path(run_id)
        try:
            sidecar = json.loads(self._sidecar_path(run_id).read_bytes())
            return StoredRun(
                id=run_id,
                path=path,
                created=str(sidecar["created"]),
                title=str(sidecar["title"]),
                summary=dict(sidecar["summary"]),
            )
        except (OSError, ValueError, TypeError, KeyError):
            return self._derived(run_id, path)

    def _derived(self, run_id: str, path: Path) -> StoredRun:
        """A run whose sidecar cannot be used, from its recording; a damaged one says so."""
        created = datetime.fromtimestamp(path.stat().st_mtime, UTC)
        title: str
        summary: dict[str, Any] = {}
        try:
            result = read_recording(path)
            title, summary = result.scenario.title, _plain_summary(result)
        except RecordingError as error:
            title = str(error)
        return StoredRun(
            id=run_id,
            path=path,
            created=created.isoformat(timespec="milliseconds"),
            title=title,
            summary=summary,
        )

    def _write_sidecar(self, stored: StoredRun) -> None:
        document = {"created": stored.created, "title": stored.title, "summary": stored.summary}
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)
        with atomic_file(self._sidecar_path(stored.id), overwrite=True) as stream:
            stream.write(text.encode())

    def _recording_path(self, run_id: str) -> Path:
        return self._folder / f"{run_id}.mcap"

    def _sidecar_path(self, run_id: str) -> Path:
        return self._folder / f"{run_id}.json"


def _plain_summary(result: RunResult) -> dict[str, Any]:
    """The summary as it reads back from a sidecar, with lists for tuples."""
    return json.loads(json.dumps(result.summary()))


def _is_file(path: Path) -> bool:
    """Whether it is a file of its own; a link could lead anywhere."""
    return path.is_file() and not path.is_symlink()
