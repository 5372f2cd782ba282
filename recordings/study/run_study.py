"""A study from its first run to its last, as a Python program asks for it."""

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

    The file grows as ``PATH.part``; where that is left of the same study, it goes on behind
    its last row. Recordings, where the study keeps any, are written beside it to the folder
    ``NAME-recordings`` as ``INDEX.mcap``.

    Args:
        study: The study.
        path: The file to write.
        executor: ``processes``, ``inline``, ``dask`` or ``dask://HOST:PORT``.
        workers: How many runs are simulated at a time; as many as there are processors if None.
        progress: Called with the share of the runs that is done, 0 to 1.
        should_stop: Asked about 20 times a second; True ends the study, to be continued.

    Returns:
        The rows, all of them or as far as it got.

    Raises:
        ScenarioError: Naming the first runs that cannot be simulated.
        ExecutorError: If there is nobody to simulate.
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
