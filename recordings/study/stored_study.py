"""A study in the store, and the sidecar that describes it without reading the study."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from slipgrasp.core.study.definition import MAX_RUNS, KeptRecordings
from slipgrasp.recordings.store.sidecars import Sidecars
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.reader import open_study


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredStudy:
    """A study in the store.

    Attributes:
        id: Its name in the store, twelve letters and digits.
        created: When it was asked for, ISO 8601 in UTC.
        title: What it is about.
        base_name: The preset that varies; empty if it is none.
        keys: What varies, by dotted key.
        num_runs: How many runs it has; 0 if its file cannot be read.
        recordings: Of which runs the recording is kept.
        end: How it ended; None while it is not finished.
        idempotency_key: What the client called its request; empty if nothing.
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
    """A study of which no more is known than that there is a file of it."""
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
    """A study as read from its file, with the details that are known of its simulation.

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


class StudySidecars(Sidecars[StoredStudy]):
    """The sidecars of a folder of studies.

    Args:
        folder: Where they lie.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, StoredStudy, _is_possible)


def _is_possible(stored: StoredStudy) -> bool:
    """Whether its numbers are such as a study can have."""
    num_ended = 0 if stored.end is None else stored.end.runs
    return 1 <= stored.num_runs <= MAX_RUNS and 0 <= num_ended <= stored.num_runs
