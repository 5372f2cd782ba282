"""The folder of studies: ``studies/ID.mcap`` is a study, ``ID.json`` its sidecar.

An unfinished study is ``ID.mcap.part``. The files define which studies exist; the sidecar contains
data outside the file, so that equal studies give equal files, and the end of the study, because
reading that takes long.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slipgrasp.core.study.definition import MAX_RUNS, KeptRecordings, Study
from slipgrasp.recordings.exceptions import (
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
    told_within,
)
from slipgrasp.recordings.file.atomic_file import PART_SUFFIX, part_of
from slipgrasp.recordings.store.annotations import Annotations
from slipgrasp.recordings.store.identifiers import ID, derived_id
from slipgrasp.recordings.store.job_store import JobStore, StoredJob
from slipgrasp.recordings.store.run_files import time_of
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.reader import open_study
from slipgrasp.recordings.study.task import StudyRun
from slipgrasp.recordings.study.writer import StudyWriter

STUDIES_FOLDER = "studies"
MAX_NAME_LENGTH = 150

_logger = logging.getLogger(__name__)


class StudyNotFoundError(RecordingNotFoundError):
    """The study does not exist."""

    noun = "study"


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStudy(StoredJob):
    """A stored study.

    Attributes:
        title: Its title.
        base_name: Preset of its base; empty if there is none.
        keys: Varied parameters by dotted key.
        num_runs: Number of runs; 0 if its file cannot be read.
        recordings: Runs whose recording is stored.
        end: Its end; None while it is unfinished.
    """

    title: str = ""
    base_name: str = ""
    keys: tuple[str, ...] = ()
    num_runs: int = 0
    recordings: KeptRecordings = "none"
    end: StudyEnd | None = None

    @property
    def is_possible(self) -> bool:
        """Whether its numbers are valid."""
        num_ended = 0 if self.end is None else self.end.runs
        return 1 <= self.num_runs <= MAX_RUNS and 0 <= num_ended <= self.num_runs


class StudyStore(JobStore[StoredStudy]):
    """Stores studies in a folder of the data directory, and their recordings among the runs.

    Args:
        data_directory: The folder of the runs.
        runs: Store of the runs.
    """

    noun = "study"

    def __init__(self, data_directory: Path, runs: RecordingStore) -> None:
        super().__init__(data_directory / STUDIES_FOLDER, runs, StoredStudy)
        self._seen: dict[str, tuple[object, StoredStudy]] = {}

    def prepare(self) -> None:
        """Creates the folder if it is missing.

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
        """Stores a study without simulated runs.

        Raises:
            RecordingWriteError: If a file cannot be written.
            StorageFullError: If there is no space.
        """
        self.prepare()
        self.runs.check_space()
        new: dict[str, Any] = self._new(idempotency_key, request_digest)
        stored = StoredStudy(**new, **_facts_of(study))
        self._write_sidecar(stored)
        with StudyWriter(self.path_of(stored.id), study):
            return stored

    def get(self, study_id: str) -> StoredStudy:
        """Returns a study by its id; one that cannot be read has a `finding`.

        Raises:
            StudyNotFoundError: If it does not exist, for any text.
        """
        path = self._find(study_id)
        is_finished = path == self.path_of(study_id)
        stored = self._read_sidecar(study_id)
        if stored is None or (is_finished and stored.end is None):
            stored = self._read_again(study_id, path, stored)
        return stored if is_finished else replace(stored, end=None)

    def find_end(self, study_id: str) -> StudyEnd | None:
        """The end of a study from its file; None if it is unfinished."""
        return self.get(study_id).end if _is_own_file(self.path_of(study_id)) else None

    def path_of(self, study_id: str) -> Path:
        """Path of the file of a finished study."""
        return self._folder / f"{study_id}.mcap"

    def file_of(self, study_id: str) -> Path:
        """Path of the current file of a study, finished or not."""
        path = self.path_of(study_id)
        return path if path.exists() else part_of(path)

    def note_end(self, stored: StoredStudy, end: StudyEnd) -> StoredStudy:
        """Stores the end of a study, after its file is finished."""
        ended = replace(stored, end=end)
        self._note(ended)
        return ended

    def delete(self, study_id: str) -> None:
        """Deletes a study permanently, even a damaged one; the recordings of its runs are retained.

        Raises:
            StudyNotFoundError: If it does not exist.
            RecordingError: If it cannot be deleted.
        """
        self._find(study_id)
        path = self.path_of(study_id)
        try:
            for file in (path, part_of(path)):
                file.unlink(missing_ok=True)
        except OSError as error:
            raise RecordingError(f"cannot delete study '{study_id}': {error.strerror}") from error
        # A sidecar alone is not a study; other files with its name are retained.
        with suppress(OSError):
            self._sidecar(study_id).unlink(missing_ok=True)
        self._seen.pop(study_id, None)

    def keeper_of(self, stored: StoredStudy) -> Callable[[StudyRun], str | None]:
        """Returns a function that stores recordings of a study's runs, and logs the first failure.

        Returns:
            A function that returns the id of a recording; None if it cannot be written.
        """
        lost: list[int] = []

        def keep(run: StudyRun) -> str | None:
            try:
                return self.save_recording(stored, run).id
            except RecordingError as error:
                if not lost:
                    _logger.error("run %d of study %s: %s", run.row.index, stored.id, error)
                    lost.append(run.row.index)
                return None

        return keep

    def save_recording(self, stored: StoredStudy, run: StudyRun) -> StoredRun:
        """Stores the recording of a run with a constant id.

        Raises:
            RecordingWriteError: If a file cannot be written.
            StorageFullError: If there is no space.
        """
        assert run.recording is not None
        run_id, mark = self.mark_of(stored, run.row.index)
        return self.runs.keep(run_id, run.recording.data, run.recording.description, mark)

    def mark_of(self, stored: StoredStudy, index: int) -> tuple[str, Annotations]:
        """The id of the recording of a run, and its automatic annotations."""
        name = f"{stored.title[:MAX_NAME_LENGTH] or 'study'}, run {index}"
        return derived_id(stored.id, index), Annotations(name=name, tags=(f"study {stored.id}",))

    def find_recording(self, stored: StoredStudy, index: int) -> StoredRun | None:
        """The recording of a run of a study, if it exists."""
        try:
            return self.runs.get(derived_id(stored.id, index))
        except RecordingNotFoundError:
            return None

    def _find(self, study_id: str) -> Path:
        """Finds the file of a study in the folder.

        Raises:
            StudyNotFoundError: If it does not exist, for any text.
        """
        path = self.path_of(study_id)
        if ID.fullmatch(study_id):
            # The unfinished file first, because the study may be finished between the two checks.
            has_part = _is_own_file(part_of(path))
            if _is_own_file(path):
                return path
            if has_part:
                return part_of(path)
        raise StudyNotFoundError(study_id)

    def _find_names(self) -> Iterator[str]:
        # Unfinished files first, because one may be finished and renamed meanwhile.
        for suffix in (f".mcap{PART_SUFFIX}", ".mcap"):
            paths = filter(_is_own_file, self._folder.glob(f"*{suffix}"))
            yield from (path.name.partition(".")[0] for path in paths)

    def _read_again(self, study_id: str, path: Path, known: StoredStudy | None) -> StoredStudy:
        """Describes a study from its file, if the sidecar is missing or older; reads it once."""
        try:
            status = path.stat()
        except OSError:
            raise StudyNotFoundError(study_id) from None
        stamp = (path, status.st_size, status.st_mtime_ns, status.st_ino)
        if (seen := self._seen.get(study_id)) is not None and seen[0] == stamp:
            return seen[1]
        stored = known or StoredStudy(id=study_id, created=time_of(status))
        try:
            with open_study(path) as reader:
                for _ in reader.chunks():
                    pass
        except RecordingError as error:
            _logger.warning("study %s cannot be read: %s", study_id, error)
            stored = replace(stored, finding=told_within(error, self._folder))
        else:
            stored = replace(stored, **_facts_of(reader.study), end=reader.end)
            self._note(stored)
        self._seen[study_id] = stamp, stored
        return stored

    def _note(self, stored: StoredStudy) -> None:
        """Writes the sidecar if possible; otherwise the file suffices."""
        try:
            self._write_sidecar(stored)
        except RecordingError as error:
            _logger.warning("study %s has an old sidecar: %s", stored.id, error)


def _facts_of(study: Study) -> dict[str, Any]:
    """The description of a study that its sidecar has."""
    return {
        "title": study.title,
        "base_name": study.base_name,
        "keys": study.keys,
        "num_runs": study.num_runs,
        "recordings": study.recordings,
    }


def _is_own_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()
