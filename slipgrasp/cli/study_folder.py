"""Folder of a study of the command line: its file, table, map and recordings."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path
from typing import Any

from slipgrasp.cli.status import CommandError
from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.exceptions import RecordingBusyError, RecordingError, RecordingExistsError
from slipgrasp.recordings.file.atomic_file import atomic_file, part_of
from slipgrasp.recordings.study.documents import definition_document
from slipgrasp.recordings.study.reader import open_study, read_rows_so_far
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.task import StudyRun
from slipgrasp.recordings.study.writer import StudyWriter

RESULTS_FOLDER = "study-results"
STUDY = "study.mcap"
TABLE = "results.csv"
MAPS = ("map.svg", "map.png")
RECORDINGS = "recordings"

# Unlike the suffix of unfinished runs, so that files of a killed process are replaced.
COPY_SUFFIX = ".copy.part"


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """A folder for one study.

    Attributes:
        path: The folder.
        overwrite: Whether an existing study is replaced.
    """

    path: Path
    overwrite: bool

    @property
    def study(self) -> Path:
        """The file of the study."""
        return self.path / STUDY

    def writer(self, study: Study) -> StudyWriter:
        """A writer that continues the file of the study."""
        return StudyWriter(self.study, study, overwrite=self.overwrite)

    def read_rows(self, results: StudyResults, num_rows: int) -> None:
        """Reads the stored runs into the results."""
        if num_rows:
            with open_study(part_of(self.study)) as reader:
                for row in islice(reader.rows(), num_rows):
                    results.append(row)

    def keep(self, run: StudyRun) -> str | None:
        """Writes the recording of a run; returns its id, or None if that fails."""
        assert run.recording is not None
        run_id = f"run-{run.row.index}"
        try:
            (self.path / RECORDINGS).mkdir(exist_ok=True)
            path = self.path / RECORDINGS / f"{run_id}.mcap"
            with atomic_file(path, overwrite=True, part_suffix=COPY_SUFFIX) as stream:
                stream.write(run.recording.data)
        except (OSError, RecordingError):
            return None  # their number is printed at the end
        return run_id

    def save_results(self, results: StudyResults, *, with_maps: bool) -> dict[str, Any]:
        """Writes the table, and the map if there is one.

        Args:
            results: The results.
            with_maps: Whether maps are drawn, which takes longest.

        Returns:
            Files: name to path, ``maps`` to several paths.

        Raises:
            RecordingWriteError: If a file cannot be written.
        """
        table = self.path / TABLE
        with atomic_file(table, overwrite=True) as stream:
            text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
            results.write_csv(text)
            text.flush()
            text.detach()
        kept = self.path / RECORDINGS
        study = self.study if self.study.exists() else part_of(self.study)
        return {
            "study": str(study),
            "results": str(table),
            "maps": self._draw_maps(results) if with_maps else [],
            "recordings": str(kept) if kept.is_dir() else None,
        }

    def _draw_maps(self, results: StudyResults) -> list[str]:
        from slipgrasp.recordings.study.map_axes import choose_axes

        axes = choose_axes(results.study)
        if axes is None:
            return []
        from slipgrasp.figures.files import write_figure
        from slipgrasp.figures.success_map import draw_success_map

        figure = draw_success_map(results, *axes)
        for name in MAPS:
            write_figure(figure, self.path / name, overwrite=True)
        return [str(self.path / name) for name in MAPS]


def find_folder(
    chosen: Path | None, data_directory: Path, study: Study, *, name: str, force: bool
) -> StudyFolder:
    """Finds or creates the folder of a study before anything is simulated.

    Args:
        chosen: The folder, if one was chosen.
        data_directory: The data folder, for a new folder if none was chosen.
        study: The study; an unfinished file of the same study is continued.
        name: Name of a new folder.
        force: Whether another study and other files are replaced.

    Raises:
        CommandError: If another file is in the way.
        RecordingError: If a study is in the way.
    """
    path = (chosen or _new_folder(data_directory / RESULTS_FOLDER, study, name)).absolute()
    _make(path)
    folder = StudyFolder(path, force)
    if not force and folder.study.exists():
        raise RecordingExistsError(folder.study)
    if part_of(folder.study).exists() and not _is_begun(folder.study, study):
        _discard(folder.study, force)
    elif not force and not part_of(folder.study).exists():
        for file in (TABLE, *MAPS, RECORDINGS):
            if (path / file).exists():
                raise RecordingExistsError(path / file)
    return folder


def _new_folder(parent: Path, study: Study, name: str) -> Path:
    """The first numbered folder that is unused or contains an unfinished file of the study."""
    for number in count(1):
        folder = parent / (name if number == 1 else f"{name}-{number}")
        is_new = not folder.exists() or not any(folder.iterdir())
        if is_new or _is_begun(folder / STUDY, study):
            return folder
    raise AssertionError  # the numbers do not end


def _is_begun(path: Path, study: Study) -> bool:
    """Whether the folder contains an unfinished file of this study."""
    part = part_of(path)
    if path.exists() or not part.exists():
        return False
    so_far = read_rows_so_far(part)
    return so_far is None or so_far[0].definition == definition_document(study)


def _discard(path: Path, force: bool) -> None:
    """Removes an unfinished file of another study if allowed and not being written."""
    part = part_of(path)
    if not force:
        cause = (
            f"'{part.name}' belongs to another study; choose another folder, or replace it with "
            "--force"
        )
        raise RecordingBusyError(path, cause)
    with part.open("rb") as stream:
        if not try_lock(stream):
            raise RecordingBusyError(path, "another study is being written there")
        part.unlink()


def _make(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise CommandError(f"--output '{path}' is a file; give a folder") from None
    except OSError as error:
        raise CommandError(f"--output '{path}': {error.strerror}") from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise CommandError(f"--output '{path}': no permission to write in that folder")
