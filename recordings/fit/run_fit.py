"""Runs a fit from recordings to files: the study of its runs, and its report."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from os import PathLike
from pathlib import Path

import numpy as np

from slipgrasp.core.fit.fit import FitOptions, fit, watch_nothing
from slipgrasp.core.fit.problem import FitProblem, Observations
from slipgrasp.core.fit.progress import Watch
from slipgrasp.core.fit.report import FitReport
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.study.definition import Sampling, Study
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN, Floats
from slipgrasp.recordings.exceptions import RecordingExistsError
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.fit.journal import Journal, JournaledRuns
from slipgrasp.recordings.measured.recording import is_measured, read_measured
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.writer import StudyWriter

JOURNAL_SUFFIX = ".journal"


def read_observations(path: str | PathLike[str], noise: Mapping[str, float]) -> Observations:
    """Signals to fit, from measured data or a run.

    Args:
        path: A recording.
        noise: Standard deviation of the noise, in its unit, by name of a signal or column.

    Raises:
        FitError: If a signal was not measured.
        RecordingError: If the recording cannot be read.
    """
    columns: dict[str, tuple[str, Floats]]
    if is_measured(path):
        measured = read_measured(path)
        described = zip(measured.outline.columns, measured.values.T, strict=True)
        columns = {column.name: (column.unit, values) for column, values in described}
        return Observations.choose(measured.times, columns, noise)
    trace = read_recording(path).trace
    columns = {
        column.name: (column.unit, np.asarray(column.values, np.float64))
        for column in columns_of(trace)
        if column.name != TIME_COLUMN and not column.holds_phases
    }
    return Observations.choose(trace.times, columns, noise)


def report_path(path: Path) -> Path:
    """Path of the report of a fit, in the folder of its study."""
    return path.with_suffix(".json")


def run_fit(
    problem: FitProblem,
    path: str | PathLike[str],
    options: FitOptions | None = None,
    *,
    overwrite: bool = False,
    watch: Watch = watch_nothing,
    should_stop: Callable[[], bool] = lambda: False,
    also_write: Callable[[FitReport], None] = lambda report: None,
) -> FitReport:
    """Fits, and writes every run to a study, and the report as JSON.

    An interrupted fit is continued with the same result.

    Args:
        problem: Scenario, free parameters and data.
        path: The study to write, ``FIT.mcap``; the report is ``FIT.json``.
        options: Options of the fit; the defaults if None.
        overwrite: Whether to replace existing files and unfinished files of another fit.
        watch: Called with the progress, after every run.
        should_stop: Asked before and during every run; True ends the fit, to be continued.
        also_write: Writes other files of the report before the journal is deleted.

    Raises:
        FitError: If the fit is not possible.
        FitStoppedError: If it was stopped.
        RecordingError: If a file exists, or cannot be written.
    """
    options, file = options or FitOptions(), Path(path)
    journal_path = file.with_name(file.name + JOURNAL_SUFFIX)
    digest = _digest(problem, options)
    is_begun = journal_path.exists() and _is_of(journal_path, digest)
    if overwrite and journal_path.exists() and not is_begun:
        journal_path.unlink()
    # A fit that was killed while writing its files finds some of them.
    overwrite |= is_begun
    for target in (file, report_path(file)):
        if target.exists() and not overwrite:
            raise RecordingExistsError(target)
    with Journal(journal_path, digest) as journal:
        report = fit(
            problem,
            options,
            evaluate=JournaledRuns(journal, as_rows=True, should_stop=should_stop),
            evaluate_twin=JournaledRuns(journal, as_rows=False, should_stop=should_stop),
            watch=watch,
        )
        _write_study(problem, file, journal.rows, overwrite=overwrite)
        write_report(report, report_path(file), overwrite=overwrite)
        also_write(report)
        journal.delete()
    return report


def write_report(report: FitReport, path: Path, *, overwrite: bool = False) -> None:
    """Writes the report of a fit as JSON.

    Raises:
        RecordingError: If the file exists, or cannot be written.
    """
    text = json.dumps(report.to_mapping(), ensure_ascii=False, allow_nan=False, indent=1)
    with atomic_file(path, overwrite=overwrite) as stream:
        stream.write(text.encode())


def _is_of(journal: Path, digest: str) -> bool:
    with journal.open("rb") as stream:
        return digest.encode() in stream.readline()


def _write_study(
    problem: FitProblem, path: Path, rows: Sequence[StudyRow], *, overwrite: bool
) -> None:
    study = Study(
        base=problem.scenario,
        sampling=Sampling(method="list"),
        listed=tuple(row.values for row in rows),
        title=f"Fit of {', '.join(parameter.key for parameter in problem.parameters)}"[:200],
    )
    with StudyWriter(path, study, overwrite=overwrite) as writer:
        # Files written before a kill exist already.
        for start in range(writer.num_rows, len(rows), 20):
            writer.add(rows[start : start + 20])
        writer.finish(writer.ending())


def _digest(problem: FitProblem, options: FitOptions) -> str:
    """The digest of all inputs of a fit, and of the numerics."""
    data = [problem.data, *(each for _, each in options.held_out)]
    described = {
        "scenario": problem.scenario.to_mapping(),
        "parameters": [asdict(parameter) for parameter in problem.parameters],
        "kernel": present_provenance(problem.scenario.space).kernel,
        "starts": [options.starts, options.seed, options.twins, options.added],
        "data": [[each.names, each.sigmas.tolist()] for each in data],
    }
    digest = hashlib.sha256(json.dumps(described, sort_keys=True).encode())
    for each in data:
        digest.update(each.times.tobytes() + each.values.tobytes())
    return digest.hexdigest()
