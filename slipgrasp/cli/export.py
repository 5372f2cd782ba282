"""``slipgrasp export``: a recording as a table of text."""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import ExitStatus

if TYPE_CHECKING:
    from core.result import RunResult

__all__ = ["add_command"]


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "export",
        help="print a recording as CSV",
        description="Prints the samples of a recording as comma-separated values, SI units.",
    )
    parser.add_argument("recording", metavar="FILE.mcap", type=Path, help="the recording")
    parser.add_argument("--format", choices=["csv"], default="csv", help="format of the table")
    parser.add_argument(
        "--output", metavar="FILE", type=Path, help="where to write it, instead of standard output"
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.set_defaults(execute=_execute)


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    from recordings.csv_export import write_csv
    from recordings.reader import read_recording

    with Progress("reading the recording"):
        result = read_recording(arguments.recording)
    if arguments.output is None:
        write_csv(result, sys.stdout)
    else:
        with Progress("writing the table"):
            _write_file(result, arguments.output, arguments.force)
    return ExitStatus.COMPLETED


def _write_file(result: RunResult, output: Path, force: bool) -> None:
    from recordings.atomic_file import atomic_file
    from recordings.csv_export import write_csv

    with atomic_file(output, overwrite=force) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="\n")
        write_csv(result, text)
        text.flush()
        text.detach()
