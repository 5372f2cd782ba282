"""From a row of a study back to the whole run, checked against its hash."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from core.provenance import present_provenance
from core.result import RunResult
from core.simulator import simulate
from core.study.definition import Study, apply_values
from recordings.exceptions import RecordingError
from recordings.state_hash import state_hash
from recordings.study.reader import open_study
from recordings.study.rows import StudyRow

__all__ = ["RebuildError", "rebuild", "rebuild_run"]


class RebuildError(RecordingError):
    """A run that does not come out again as its row says."""


def rebuild_run(path: str | PathLike[str], index: int) -> RunResult:
    """Simulates one run of a study again, and checks that it is the same, bit for bit.

    Args:
        path: The file of the study.
        index: The run, from 0.

    Raises:
        NoSuchRunError: If the file has no row of it.
        RebuildError: If it is not the same, or was never simulated.
        RecordingError: If the file cannot be read.
    """
    with open_study(Path(path)) as reader:
        return rebuild(reader.study, reader.row(index))


def rebuild(study: Study, row: StudyRow) -> RunResult:
    """Simulates the run of a row again.

    Args:
        study: The study.
        row: One of its rows.

    Raises:
        RebuildError: If the run is not the same, bit for bit, or was never simulated.
    """
    if not row.state_hash:
        raise RebuildError(f"run {row.index} was never simulated: its worker died")
    result = simulate(apply_values(study.base, row.values))
    if state_hash(result) != row.state_hash:
        raise RebuildError(f"run {row.index} does not come out as its row says: {_cause(row)}")
    return result


def _cause(row: StudyRow) -> str:
    here = present_provenance().kernel
    if row.kernel == here:
        return "its row was altered, or is not of this study"
    return f"another build or kind of processor computed it ({row.kernel}, here it is {here})"
