"""The folder of studies: ``studies/ID.mcap`` is a study, ``ID.json`` how it was asked for.

A study that is not finished is ``ID.mcap.part``. The files alone say what there is; the
sidecar holds what they must not hold, so that equal studies are equal files, and how the
study ended, because reading that takes long.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from core.study.definition import KeptRecordings, Study
from recordings.annotations import Annotations
from recordings.atomic_file import PART_SUFFIX, atomic_file, part_of
from recordings.documents import parse_json
from recordings.exceptions import RecordingError, RecordingNotFoundError, RecordingWriteError
from recordings.identifiers import ID, IdSource, derived_id
from recordings.run_folder import iso_time
from recordings.store import RecordingStore
from recordings.stored_run import StoredRun
from recordings.study.documents import StudyEnd
from recordings.study.member import MemberResult
from recordings.study.reader import open_study
from recordings.study.writer import StudyWriter

__all__ = ["STUDIES_FOLDER", "StoredStudy", "StudyNotFoundError", "StudyStore"]

STUDIES_FOLDER = "studies"
MAX_NAME_LENGTH = 150

_logger = logging.getLogger(__name__)


class StudyNotFoundError(RecordingNotFoundError):
    """There is no such study."""

    def __init__(self, study_id: str) -> None:
        super().__init__(study_id)
        shown = "".join(c if c.isprintable() else "?" for c in study_id[:100])
        self.args = (f"there is no study '{shown}'",)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStudy:
    """A study in the store.

    Attributes:
        id: Its name in the store, twelve letters and digits.
        created: When it was asked for, ISO 8601 in UTC.
        title: What it is about.
        base_name: The preset that varies; empty if it is none.
        keys: What varies, by dotted key.
        num_runs: How many runs it has.
        recordings: Of which runs the recording is kept.
        end: How it ended; None while it is not finished.
        idempotency_key: What the client called its request; empty if nothing.
        request_digest: Digest of that request.
    """

    id: str
    created: str
    title: str
    base_name: str
    keys: tuple[str, ...]
    num_runs: int
    recordings: KeptRecordings
    end: StudyEnd | None = None
    idempotency_key: str = ""
    request_digest: str = ""


class StudyStore:
    """Keeps studies in a folder of the data directory, and their recordings among the runs.

    Args:
        data_directory: The folder of the runs.
        runs: The runs.
    """

    def __init__(self, data_directory: Path, runs: RecordingStore) -> None:
        self._folder = data_directory / STUDIES_FOLDER
        self._runs = runs
        self._ids = IdSource()

    def prepare(self) -> None:
        """Makes the folder if it is missing.

        Raises:
            RecordingWriteError: If nothing can be saved there.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingWriteError(self._folder, error.strerror or "no folder") from error

    def create(
        self, study: Study, *, idempotency_key: str = "", request_digest: str = ""
    ) -> StoredStudy:
        """Keeps a study of which no run is simulated yet.

        Raises:
            RecordingWriteError: If it cannot be written.
            StorageFullError: If there is no room.
        """
        self.prepare()
        self._runs.check_room()
        now = datetime.now(UTC)
        stored = StoredStudy(
            id=self._ids.new(now),
            created=iso_time(now),
            title=study.title,
            base_name=study.base_name,
            keys=study.keys,
            num_runs=study.num_runs,
            recordings=study.recordings,
            idempotency_key=idempotency_key,
            request_digest=request_digest,
        )
        self._write_sidecar(stored)
        with StudyWriter(self.path_of(stored.id), study):
            return stored

    def get(self, study_id: str) -> StoredStudy:
        """One study by its id.

        Raises:
            StudyNotFoundError: If there is none, whatever the id looks like.
            RecordingError: If it has no usable sidecar, and its file is damaged.
        """
        if not ID.fullmatch(study_id):
            raise StudyNotFoundError(study_id)
        is_finished = self.path_of(study_id).is_file()
        if not is_finished and not part_of(self.path_of(study_id)).is_file():
            raise StudyNotFoundError(study_id)
        stored = self._read_sidecar(study_id)
        if stored is None or (is_finished and stored.end is None):
            stored = self._read_again(study_id, stored)
        return stored if is_finished else replace(stored, end=None)

    def find_by_key(self, idempotency_key: str) -> StoredStudy | None:
        """The study that was asked for under a key, if there is one."""
        return next((s for s in self._all() if s.idempotency_key == idempotency_key), None)

    def list(self, offset: int = 0, limit: int | None = None) -> tuple[list[StoredStudy], int]:
        """Studies, newest first, and how many there are.

        Args:
            offset: How many of the newest to leave out.
            limit: How many to return at most; all if None.
        """
        ids = self._list_ids()
        end = None if limit is None else offset + limit
        return [*self._read_all(ids[offset:end])], len(ids)

    def unfinished(self) -> list[StoredStudy]:
        """The studies that are not finished, oldest first."""
        return [stored for stored in self._all() if stored.end is None][::-1]

    def path_of(self, study_id: str) -> Path:
        """Where the file of a study lies once it is finished."""
        return self._folder / f"{study_id}.mcap"

    def file_of(self, study_id: str) -> Path:
        """The file of a study as it is, finished or not."""
        path = self.path_of(study_id)
        return path if path.exists() else part_of(path)

    def note_end(self, stored: StoredStudy, end: StudyEnd) -> StoredStudy:
        """Notes how a study ended, once its file is finished."""
        ended = replace(stored, end=end)
        try:
            self._write_sidecar(ended)
        except RecordingWriteError as error:
            _logger.warning("study %s has an old sidecar: %s", stored.id, error)
        return ended

    def delete(self, study_id: str) -> None:
        """Removes a study for good; the recordings of its runs stay.

        Raises:
            StudyNotFoundError: If there is none.
            RecordingError: If it cannot be removed.
        """
        self.get(study_id)
        path = self.path_of(study_id)
        try:
            for file in (path, part_of(path), self._sidecar(study_id)):
                file.unlink(missing_ok=True)
        except OSError as error:
            raise RecordingError(f"cannot delete study '{study_id}': {error.strerror}") from error

    def keep_recording(self, stored: StoredStudy, member: MemberResult) -> str | None:
        """Keeps the recording of a run among the runs, always under the same id.

        Returns:
            Its id; None if it cannot be written.
        """
        try:
            return self.save_recording(stored, member).id
        except RecordingError as error:
            _logger.error("run %d of study %s: %s", member.row.index, stored.id, error)
            return None

    def save_recording(self, stored: StoredStudy, member: MemberResult) -> StoredRun:
        """The same for one that somebody waits for.

        Raises:
            RecordingWriteError: If it cannot be written.
            StorageFullError: If there is no room.
        """
        assert member.recording is not None
        name = f"{stored.title[:MAX_NAME_LENGTH] or 'study'}, run {member.row.index}"
        return self._runs.keep(
            derived_id(stored.id, member.row.index),
            member.recording.data,
            member.recording.description,
            Annotations(name=name, tags=(f"study {stored.id}",)),
        )

    def find_recording(self, stored: StoredStudy, index: int) -> StoredRun | None:
        """The recording of a run of a study, if it is kept."""
        try:
            return self._runs.get(derived_id(stored.id, index))
        except RecordingNotFoundError:
            return None

    def _sidecar(self, study_id: str) -> Path:
        return self._folder / f"{study_id}.json"

    def _list_ids(self) -> list[str]:
        ids = {
            path.name.partition(".")[0]
            for suffix in (".mcap", f".mcap{PART_SUFFIX}")
            for path in self._folder.glob(f"*{suffix}")
        }
        return sorted(filter(ID.fullmatch, ids), reverse=True)

    def _all(self) -> list[StoredStudy]:
        return [*self._read_all(self._list_ids())]

    def _read_all(self, ids: list[str]) -> Iterator[StoredStudy]:
        for study_id in ids:
            try:
                yield self.get(study_id)
            except RecordingError as error:
                _logger.warning("study %s is left out: %s", study_id, error)

    def _read_again(self, study_id: str, known: StoredStudy | None) -> StoredStudy:
        """What the file tells, where the sidecar is missing or older."""
        with open_study(self.file_of(study_id)) as reader:
            for _ in reader.chunks():
                pass
            study, end = reader.study, reader.end
        changed = datetime.fromtimestamp(self.file_of(study_id).stat().st_mtime, UTC)
        stored = StoredStudy(
            id=study_id,
            created=known.created if known else iso_time(changed),
            title=study.title,
            base_name=study.base_name,
            keys=study.keys,
            num_runs=study.num_runs,
            recordings=study.recordings,
            end=end,
            idempotency_key=known.idempotency_key if known else "",
            request_digest=known.request_digest if known else "",
        )
        self._write_sidecar(stored)
        return stored

    def _read_sidecar(self, study_id: str) -> StoredStudy | None:
        try:
            document: Mapping[str, Any] = parse_json(self._sidecar(study_id).read_bytes())
            return _reader().validate_python({**document, "id": study_id})
        except (OSError, TypeError, ValidationError, ValueError):
            return None

    def _write_sidecar(self, stored: StoredStudy) -> None:
        with atomic_file(self._sidecar(stored.id), overwrite=True) as stream:
            stream.write(json.dumps(asdict(stored), ensure_ascii=False, indent=1).encode())


@cache
def _reader() -> TypeAdapter[StoredStudy]:
    return TypeAdapter(StoredStudy)
