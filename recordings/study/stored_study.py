"""A stored study, and its sidecar, which describes it without reading its file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from slipgrasp.core.study.definition import MAX_RUNS, KeptRecordings
from slipgrasp.recordings.store.sidecars import Sidecars
from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.reader import open_study


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
        finding: Reason why its file cannot be read; empty if it can.
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


class StudySidecars(Sidecars[StoredStudy]):
    """The sidecars of a folder of studies.

    Args:
        folder: Their folder.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, StoredStudy, _is_possible)


def _is_possible(stored: StoredStudy) -> bool:
    """Whether its numbers are valid."""
    num_ended = 0 if stored.end is None else stored.end.runs
    return 1 <= stored.num_runs <= MAX_RUNS and 0 <= num_ended <= stored.num_runs
