"""A stored study, and its sidecar, which describes it without reading its file."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic import TypeAdapter, ValidationError

from slipgrasp.core.study.definition import MAX_RUNS, KeptRecordings
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.store.run_files import checked_time, read_document
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.reader import open_study

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStudy:
    """A stored study.

    Attributes:
        id: Its id, twelve letters and digits.
        created: Time of its creation, ISO 8601 in UTC.
        title: Its title.
        base_name: Preset of its base; empty if there is none.
        keys: Varied parameters by dotted key.
        num_runs: Number of runs; 0 if its file cannot be read.
        recordings: Runs whose recording is stored.
        end: Its end; None while it is unfinished.
        idempotency_key: Idempotency key of its request; may be empty.
        request_digest: Digest of that request.
        finding: Why its file cannot be read; empty if it can.
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
    finding: str = ""


def unknown_study(study_id: str, created: str) -> StoredStudy:
    """A study of which only the file name is known."""
    return StoredStudy(
        id=study_id,
        created=created,
        title="",
        base_name="",
        keys=(),
        num_runs=0,
        recordings="none",
    )


def told_by_file(path: Path, made: StoredStudy) -> StoredStudy:
    """A study read from its file, with known details of its simulation.

    Raises:
        RecordingError: If the file is damaged.
    """
    with open_study(path) as reader:
        for _ in reader.chunks():
            pass
        study, end = reader.study, reader.end
    return replace(
        made,
        title=study.title,
        base_name=study.base_name,
        keys=study.keys,
        num_runs=study.num_runs,
        recordings=study.recordings,
        end=end,
    )


class StudySidecars:
    """The sidecars of a folder of studies; only one is written at a time.

    Args:
        folder: Their folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = Lock()

    def path_of(self, study_id: str) -> Path:
        """Path of the sidecar of a study."""
        return self._folder / f"{study_id}.json"

    def read(self, study_id: str) -> StoredStudy | None:
        """Reads the sidecar of a study; None if it is missing or unusable.

        Defects of an unusable one are logged.
        """
        document = read_document(self.path_of(study_id))
        if not document:
            return None
        facts = {**document, "id": study_id, "created": checked_time(document.get("created"))}
        try:
            stored: StoredStudy = _reader().validate_python({**facts, "finding": ""})
        except ValidationError as error:
            finding = error.errors(include_url=False)[0]
            where = ".".join(map(str, finding["loc"]))
            _logger.warning("the sidecar of study %s: %s: %s", study_id, where, finding["msg"])
            return None
        return stored if _is_possible(stored) else None

    def write(self, stored: StoredStudy) -> None:
        """Writes the sidecar of a study.

        Raises:
            RecordingBusyError: If another process is writing it.
            RecordingWriteError: If it cannot be written; the old one is then unchanged.
        """
        document = asdict(stored)
        del document["finding"]
        text = json.dumps(document, ensure_ascii=False, indent=1).encode()
        with self._lock, atomic_file(self.path_of(stored.id), overwrite=True) as stream:
            stream.write(text)


def _is_possible(stored: StoredStudy) -> bool:
    """Whether its numbers are valid."""
    num_ended = 0 if stored.end is None else stored.end.runs
    return 1 <= stored.num_runs <= MAX_RUNS and 0 <= num_ended <= stored.num_runs


@cache
def _reader() -> TypeAdapter[Any]:
    return TypeAdapter(StoredStudy)
