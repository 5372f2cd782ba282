"""Simulates a run of a study again, and checks its hash."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path

from slipgrasp.core.executors import Cancelled
from slipgrasp.core.run.numerics import same_bits
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.custom_laws import custom_law
from slipgrasp.core.scenario.space import Space
from slipgrasp.core.study.definition import Study, apply_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.compare.verification import WALL_TIME
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.study.reader import open_study
from slipgrasp.recordings.study.study_row import StudyRow


class RebuildError(RecordingError):
    """A run that differs from its result in the study."""


def rebuild_run(path: str | PathLike[str], index: int) -> RunResult:
    """Simulates one run of a study again, and checks that it is equal, bit for bit.

    Args:
        path: The file of the study.
        index: The run, from 0.

    Raises:
        NoSuchRunError: If the file has no result of it.
        RebuildError: If it differs, or was never simulated.
        RecordingError: If the file cannot be read.
    """
    with open_study(Path(path)) as reader:
        return rebuild(reader.study, reader.row(index))


def rebuild(
    study: Study,
    row: StudyRow,
    *,
    should_stop: Callable[[], bool] | None = None,
    wall_limit: float | None = None,
) -> RunResult:
    """Simulates the run of a row again.

    Args:
        study: The study.
        row: One of its rows.
        should_stop: Called every few milliseconds; True stops the simulation.
        wall_limit: Limit of elapsed time [s]; none if None.

    Raises:
        RebuildError: If the run differs, was never simulated, ended by its elapsed time, or takes
            too long.
        Cancelled: If it was stopped.
    """
    if not row.state_hash:
        raise RebuildError(f"run {row.index} was never simulated: its worker died")
    if row.outcome is Outcome.LIMIT and row.reason is not None and row.reason.code == WALL_TIME:
        raise RebuildError(
            f"run {row.index} reached its limit of elapsed time after {row.end_time:.4g} s of "
            "simulated time, which is not reproducible; simulate its values as a new run"
        )
    _check_laws(study, row)
    scenario = apply_values(study.base, row.values)
    result = simulate(scenario, should_stop=should_stop, wall_limit=wall_limit)
    if result.outcome is Outcome.STOPPED:
        raise Cancelled
    if result.reason is not None and result.reason.code == WALL_TIME:
        raise RebuildError(
            f"run {row.index} takes more than {wall_limit:g} s of elapsed time; use "
            "'slipgrasp rebuild' on the command line, which has no limit"
        )
    if state_hash(result) != row.state_hash:
        cause = _cause(row, scenario.space)
        raise RebuildError(f"run {row.index} differs from its result in the study: {cause}")
    return result


def _check_laws(study: Study, row: StudyRow) -> None:
    """Checks the version of the law first, because another version gives an unclear difference."""
    for then in study.computed_by:
        now = custom_law(then.name)
        if now is not None and now.identity != then:
            raise RebuildError(
                f"run {row.index} was computed with the law '{then.name}', version {then.version}, "
                f"digest {then.digest[:12]}, but the loaded version is {now.identity.version}, "
                f"digest {now.identity.digest[:12]}: load the original version"
            )


def _cause(row: StudyRow, space: Space) -> str:
    here = present_provenance(space).kernel
    if same_bits(row.kernel, here):
        return "its result was altered, or belongs to another study"
    return f"another version of the kernel computed it ({row.kernel}, now {here})"
