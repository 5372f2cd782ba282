"""Runs a study from a Python program."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path

from slipgrasp.core.executors import make_executor
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import check_members
from slipgrasp.recordings.file.atomic_file import atomic_file, part_of
from slipgrasp.recordings.study.results import StudyResults, read_results
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.study_row import StudyRow
from slipgrasp.recordings.study.task import StudyRun
from slipgrasp.recordings.study.writer import StudyWriter


def run_study(
    study: Study,
    path: str | PathLike[str],
    *,
    executor: str = "processes",
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StudyResults:
    """Simulates every run of a study and writes it as one MCAP file.

    The unfinished file is ``PATH.part``; if it exists for the same study, it is continued after its
    last row. Recordings, if the study stores any, are written to the folder ``NAME-recordings``
    next to it as ``INDEX.mcap``.

    Args:
        study: The study.
        path: The file to write.
        executor: ``processes``, ``inline``, ``dask`` or ``dask://HOST:PORT``.
        workers: Number of concurrent runs; as many as there are processors if None.
        progress: Called with the completed fraction, 0 to 1.
        should_stop: Called about 20 times a second; True stops the study, which can be continued.

    Returns:
        The results, complete or so far.

    Raises:
        ScenarioError: If runs cannot be simulated; names the first ones.
        ExecutorError: If there are no workers.
        RecordingError: If the file exists, or cannot be written.
    """
    check_members(study)
    file = Path(path)
    folder = file.with_name(f"{file.stem}-recordings")

    def watch(row: StudyRow) -> None:
        if progress is not None:
            progress((row.index + 1) / study.num_runs)

    def keep(run: StudyRun) -> str:
        assert run.recording is not None
        folder.mkdir(exist_ok=True)
        with atomic_file(folder / f"{run.row.index}.mcap", overwrite=True) as stream:
            stream.write(run.recording.data)
        return str(run.row.index)

    with StudyWriter(file, study) as writer, make_executor(executor, workers=workers) as engine:
        end = schedule_runs(
            study,
            engine,
            writer,
            should_stop=should_stop or (lambda: False),
            watch=watch,
            keep=keep,
        )
        if end.state == "completed":
            writer.finish(end)
    written = file if end.state == "completed" else part_of(file)
    return read_results(written)
