"""``slipgrasp export``: export a recording to other formats."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from slipgrasp.cli.arguments import add_data_directory, recording_path, refuse_existing
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import CommandError, ExitStatus
from slipgrasp.recordings.clip import Clip
from slipgrasp.recordings.export import (
    DATA_FORMATS,
    EXPORT_FORMATS,
    MOVING_FORMATS,
    ExportFormat,
)
from slipgrasp.recordings.still import Still

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult

Update = Callable[[float], None]

NAME = "export"
FORMATS = {each.name: each for each in EXPORT_FORMATS}
MOST_FRAMES_PER_SECOND = 50.0
EPILOG = "exit status: 0 written, 2 bad input. For the paper's figures see 'slipgrasp figures'."


def _listed(words: list[str], conjunction: str) -> str:
    """Joins words to a list in a sentence."""
    return f"{', '.join(words[:-1])}{conjunction} {words[-1]}"


def _described() -> Iterator[str]:
    """The content of each format, grouped by equal content."""
    for contents, formats in groupby(EXPORT_FORMATS, lambda each: each.contents):
        titles = " or ".join(each.title for each in formats if each in DATA_FORMATS)
        yield f"as {titles} ({contents})" if titles else f"as {contents}"


HELP = f"write a recording as {_listed([each.title for each in EXPORT_FORMATS], ' or')}"
DESCRIPTION = f"Write a recording {_listed([*_described()], ', or')}. Units are SI."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    names = _listed([each.name for each in MOVING_FORMATS], " and")
    rates = _listed([f"{each.fps:g}" for each in MOVING_FORMATS], " and")
    parser.add_argument(
        "recording", metavar="FILE.mcap|ID", help="the recording, or the id of a stored run"
    )
    parser.add_argument(
        "--format",
        choices=FORMATS.keys(),
        help="format to write (default: by the suffix of --output, csv without --output)",
    )
    parser.add_argument(
        "--output", metavar="FILE", type=Path, help="file to write (default: standard output)"
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.add_argument(
        "--fps",
        metavar="N",
        type=_frames_per_second,
        help=f"frames per second of {names}, at most {MOST_FRAMES_PER_SECOND:g} (default: {rates})"
        "; fewer for long runs",
    )
    parser.add_argument(
        "--assumptions",
        "--premises",
        action="store_true",
        dest="premises",
        help="add the assumptions and bounds of the paper's theorems as columns of data",
    )
    _add_clip(parser)
    _add_still(parser)
    add_data_directory(parser)


def _add_clip(parser: argparse.ArgumentParser) -> None:
    """Adds the options of animations."""
    clip = parser.add_argument_group("animations, and charts in stills")
    clip.add_argument("--start", metavar="T", type=float, help="start of the time range [s]")
    clip.add_argument("--end", metavar="T", type=float, help="end of the time range [s]")
    clip.add_argument(
        "--speed",
        metavar="X",
        type=Fraction,
        default=Fraction(1),
        help="simulated seconds per second, such as 1/32 (default: 1)",
    )
    height = "height of a GIF (default: 560) or a video (default: 720), such as 1080"
    clip.add_argument("--height", metavar="PX", type=int, help=height)


def _add_still(parser: argparse.ArgumentParser) -> None:
    """Adds the options of stills."""
    still = parser.add_argument_group("stills")
    still.add_argument(
        "--at", metavar="T", type=float, help="time of the still [s] (default: the end)"
    )
    usual = Still()
    still.add_argument(
        "--size",
        metavar="WxH",
        type=_size,
        default=(usual.width, usual.height),
        help=f"width and height in pixels (default: {usual.width}x{usual.height})",
    )


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text} is not a width and a height, such as 1920x1080"
        ) from None


def _still_of(arguments: argparse.Namespace) -> Still:
    width, height = arguments.size
    return Still(time=arguments.at, width=width, height=height)


def _clip_of(arguments: argparse.Namespace) -> Clip:
    return Clip(
        start=arguments.start,
        end=arguments.end,
        speed=float(arguments.speed),
        height=arguments.height,
    )


def _frames_per_second(text: str) -> float:
    fps = float(text)
    if not 1.0 <= fps <= MOST_FRAMES_PER_SECOND:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and {MOST_FRAMES_PER_SECOND:g}")
    return fps


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    output: Path | None = arguments.output
    chosen = FORMATS[arguments.format or _format_of(output)]
    clip, still = _clip_of(arguments), _still_of(arguments)
    if not chosen.is_text and output is None and sys.stdout.isatty():
        raise CommandError(f"{chosen.name} is not for a terminal; name a file with --output")
    if arguments.premises and chosen not in DATA_FORMATS:
        names = _listed([each.name for each in DATA_FORMATS], " or")
        raise CommandError(f"--assumptions adds columns, {chosen.name} has none; choose {names}")
    refuse_existing(output, arguments.force)
    path = recording_path(arguments.recording, arguments.data_directory)
    with Progress("reading the recording"):
        from slipgrasp.recordings.file.reader import read_recording
        from slipgrasp.recordings.measured.recording import is_measured

        if is_measured(path):
            return _export_measured(path, chosen, arguments)
        result = read_recording(path)
    if chosen.is_text and output is None:
        chosen.write(result, sys.stdout.buffer, premises=arguments.premises)
    else:
        with Progress(f"writing the {chosen.name} file") as progress:
            _write(result, chosen, arguments, clip, still, progress.update)
    return ExitStatus.COMPLETED


def _export_measured(path: Path, chosen: ExportFormat, arguments: argparse.Namespace) -> ExitStatus:
    """Writes measured data as a table."""
    from slipgrasp.recordings.measured.recording import read_measured
    from slipgrasp.recordings.measured.table import MEASURED_TABLES

    if chosen.name not in MEASURED_TABLES:
        names = _listed([*MEASURED_TABLES], " or")
        raise CommandError(f"measured data cannot be written as {chosen.name}; choose {names}")
    if arguments.premises:
        raise CommandError("--assumptions needs a run; this recording is measured data")
    measured, write = read_measured(path), MEASURED_TABLES[chosen.name]
    _to_output(lambda stream: write(measured, stream), arguments)
    return ExitStatus.COMPLETED


def _format_of(output: Path | None) -> str:
    """The format that the name of a file implies."""
    if output is None:
        return EXPORT_FORMATS[0].name
    ending = output.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        raise CommandError(
            f"--output '{output}' does not end with a format; choose one with --format: "
            + ", ".join(FORMATS)
        )
    return ending


def _write(
    result: RunResult,
    chosen: ExportFormat,
    arguments: argparse.Namespace,
    clip: Clip,
    still: Still,
    update: Update,
) -> None:
    def write(stream: BinaryIO) -> None:
        fps, premises = arguments.fps, arguments.premises
        chosen.write(result, stream, update, fps, clip, still, premises=premises)

    _to_output(write, arguments)


def _to_output(write: Callable[[BinaryIO], None], arguments: argparse.Namespace) -> None:
    if arguments.output is None:
        # Some formats need a seekable file.
        with tempfile.TemporaryFile() as stream:
            write(stream)
            stream.seek(0)
            shutil.copyfileobj(stream, sys.stdout.buffer)
        return
    from slipgrasp.recordings.file.atomic_file import atomic_file

    with atomic_file(arguments.output, overwrite=arguments.force) as stream:
        write(stream)
