"""``slipgrasp rebuild``: make a recording of one run of a study."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import (
    add_data_directory,
    know_law,
    names_a_file,
    number_in,
    refuse_existing,
    store_in,
)
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.study.definition import Study
    from slipgrasp.recordings.study.study_row import StudyRow

MAX_INDEX = 999_999_999
NAME = "rebuild"
HELP = "make a recording of one run of a study"
DESCRIPTION = (
    "Simulate one run of a study again, check it against the hash in the study, and store it as a "
    "recording."
)
EPILOG = "exit status: 0 equal (stored), 1 different from the study (nothing saved), 2 bad input"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "study",
        metavar="STUDY.mcap|ID",
        help="the file of a study, finished or not (.part), or the id of a stored study",
    )
    parser.add_argument(
        "index",
        metavar="INDEX",
        type=number_in(0, MAX_INDEX, "the index of a run", "indices start at 0", of=int),
        help="index of the run, from 0",
    )
    parser.add_argument(
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="file to write (default: a new run in the data folder)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.add_argument(
        "--law",
        metavar="FILE.py:Name",
        help="load the study's custom law from this file; installed laws are found without it",
    )
    add_data_directory(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    output: Path | None = arguments.output
    refuse_existing(output, arguments.force)
    if arguments.law is not None:
        know_law(arguments.law)
    path = _study_path(arguments.study, arguments.data_directory)
    with Progress("reading the study"):
        study, row = _read_row(path, arguments.index)
    load_simulation(study.base)
    from slipgrasp.recordings.study.rebuild import RebuildError, rebuild

    try:
        with Progress("simulating again"):
            result = rebuild(study, row)
    except RebuildError as error:
        complain(str(error))
        return ExitStatus.DIFFERENT
    print(_keep(result, output, arguments.data_directory, force=arguments.force))
    return ExitStatus.COMPLETED


def _study_path(source: str, chosen: Path | None) -> Path:
    """The file of a study given by its path, or by its id in the data folder."""
    if names_a_file(source):
        return Path(source)
    from slipgrasp.cli.arguments import data_directory
    from slipgrasp.recordings.study.study_store import StudyStore

    store = StudyStore(data_directory(chosen), store_in(chosen))
    return store.file_of(store.get(source).id)


def _read_row(path: Path, index: int) -> tuple[Study, StudyRow]:
    from slipgrasp.recordings.study.reader import open_study

    with open_study(path) as reader:
        return reader.study, reader.row(index)


def _keep(result: RunResult, output: Path | None, chosen: Path | None, *, force: bool) -> Path:
    if output is not None:
        from slipgrasp.recordings.file.writer import write_recording

        write_recording(result, output, overwrite=force)
        return output
    store = store_in(chosen)
    store.prepare()
    return store.save(result).path.absolute()
