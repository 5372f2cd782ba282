"""``slipgrasp export``: a recording in formats of other programs."""

from __future__ import annotations

import argparse
import io
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from slipgrasp.cli.arguments import add_data_directory, recording_path
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult

Update = Callable[[float], None]

FORMATS = ("csv", "parquet", "npz", "html", "gif")
MOST_FRAMES_PER_SECOND = 50.0
DESCRIPTION = (
    "Writes a recording as CSV (the main signals), as Parquet or NPZ (all signals with units, and "
    "the scenario), as an HTML page that plays the 3D scene offline, or as an animated GIF. "
    "SI units."
)
EPILOG = "exit status: 0 written, 2 bad input. For the paper's figures see 'slipgrasp figures'."


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "export",
        help="write a recording as CSV, Parquet, NPZ, HTML or GIF",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument(
        "recording", metavar="FILE.mcap|ID", help="the recording, or the id of a stored run"
    )
    parser.add_argument(
        "--format",
        choices=FORMATS,
        help="format to write (default: as --output ends, csv without one)",
    )
    parser.add_argument(
        "--output", metavar="FILE", type=Path, help="where to write it, instead of standard output"
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.add_argument(
        "--fps",
        metavar="N",
        type=_frames_per_second,
        help="frames per second of html and gif, at most 50 (default: 30 and 20); fewer where a "
        "run is too long for that many",
    )
    add_data_directory(parser)
    parser.set_defaults(execute=_execute)


def _frames_per_second(text: str) -> float:
    fps = float(text)
    if not 1.0 <= fps <= MOST_FRAMES_PER_SECOND:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and {MOST_FRAMES_PER_SECOND:g}")
    return fps


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    output: Path | None = arguments.output
    chosen = arguments.format or _format_of(output)
    if chosen != "csv" and output is None and sys.stdout.isatty():
        raise CommandError(f"{chosen} is not for a terminal; name a file with --output")
    if output is not None and output.exists() and not arguments.force:
        from slipgrasp.recordings.exceptions import RecordingExistsError

        raise RecordingExistsError(output)
    with Progress("reading the recording"):
        from slipgrasp.recordings.file.reader import read_recording

        result = read_recording(recording_path(arguments.recording, arguments.data_directory))
    if chosen == "csv" and output is None:
        from slipgrasp.recordings.export import write_csv

        write_csv(result, sys.stdout)
    else:
        with Progress(f"writing the {chosen} file") as progress:
            _write(result, chosen, arguments, progress.update)
    return ExitStatus.COMPLETED


def _format_of(output: Path | None) -> str:
    """What the name of a file asks for."""
    if output is None:
        return "csv"
    ending = output.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        raise CommandError(
            f"--output '{output}' does not end with a format; choose one with --format: "
            + ", ".join(FORMATS)
        )
    return ending


def _write(result: RunResult, chosen: str, arguments: argparse.Namespace, update: Update) -> None:
    if arguments.output is None:
        # Not every format can be written to a pipe as it grows.
        with tempfile.TemporaryFile() as stream:
            _write_stream(result, chosen, stream, arguments.fps, update)
            stream.seek(0)
            shutil.copyfileobj(stream, sys.stdout.buffer)
        return
    from slipgrasp.recordings.file.atomic_file import atomic_file

    with atomic_file(arguments.output, overwrite=arguments.force) as stream:
        _write_stream(result, chosen, stream, arguments.fps, update)


def _write_stream(
    result: RunResult, chosen: str, stream: BinaryIO, fps: float | None, update: Update
) -> None:
    if chosen == "csv":
        _write_text(result, stream)
    elif chosen == "parquet":
        from slipgrasp.recordings.export import write_parquet

        write_parquet(result, stream)
    elif chosen == "npz":
        from slipgrasp.recordings.export import write_npz

        write_npz(result, stream)
    elif chosen == "html":
        from slipgrasp.web.charts import replay_page

        replay_page.write_html(result, stream, update, **({} if fps is None else {"fps": fps}))
    else:
        from slipgrasp.figures import animation

        animation.write_gif(result, stream, update, **({} if fps is None else {"fps": fps}))


def _write_text(result: RunResult, stream: BinaryIO) -> None:
    from slipgrasp.recordings.export import write_csv

    text = io.TextIOWrapper(stream, encoding="utf-8", newline="\n")
    write_csv(result, text)
    text.flush()
    text.detach()
