"""``slipgrasp diff``: differences between two recordings."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, recording_path, refuse_existing
from slipgrasp.cli.figures import FORMATS
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult
    from slipgrasp.recordings.compare.comparison import Comparison

NAME = "diff"
HELP = "compare two recordings"
DESCRIPTION = (
    "Compare two recordings at their common sampling times: parameters, phase changes, "
    "columns (the first and the largest deviation) and metrics. Two runs are equal if outcome, end "
    "time, phase changes and all columns agree within the tolerance, and if the metrics of each "
    "agree with its samples. Parameters may differ. For measured data ('slipgrasp import') the "
    "command prints the deviation of every common signal at the measured times."
)
EPILOG = "exit status: 0 equal within the tolerance, 1 different, 2 cannot be compared"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    for name in ("a", "b"):
        parser.add_argument(
            name, metavar=name.upper(), help="a recording (FILE.mcap) or the id of a stored run"
        )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--tolerance",
        metavar="T",
        type=float,
        help="largest absolute difference at which values count as equal, in SI units (default: "
        "the integration error that the tolerances allow; 0 for measured data)",
    )
    parser.add_argument(
        "--figure",
        metavar="FILE",
        type=Path,
        help="draw both runs and their difference, as .svg, .pdf or .png",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --figure file")
    add_data_directory(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    from slipgrasp.recordings.compare.comparison import check_tolerance, compare
    from slipgrasp.recordings.measured.recording import is_measured

    tolerance: float | None = arguments.tolerance
    if tolerance is not None:
        check_tolerance(tolerance)
    _check_figure(arguments.figure, arguments.force)
    paths = [
        recording_path(source, arguments.data_directory) for source in (arguments.a, arguments.b)
    ]
    if any(map(is_measured, paths)):
        return _measure(paths, arguments)
    a, b = map(_read, paths)
    comparison = compare(a, b, tolerance)
    if arguments.figure is not None:
        _draw(comparison, a, b, arguments)
    if arguments.json:
        print(json.dumps(comparison.to_mapping(), allow_nan=False))
    else:
        from slipgrasp.cli.differences import describe_differences

        print(describe_differences(comparison, a.scenario.finger_names))
    return ExitStatus.COMPLETED if comparison.equal else ExitStatus.DIFFERENT


def _check_figure(path: Path | None, force: bool) -> None:
    if path is None:
        return
    if path.suffix.lower().removeprefix(".") not in FORMATS:
        raise CommandError(f"--figure '{path}' does not end in .svg, .pdf or .png")
    refuse_existing(path, force)


def _read(path: Path) -> RunResult:
    from slipgrasp.recordings.file.reader import read_as_stated

    with Progress(f"reading {path.name}"):
        return read_as_stated(path)


def _measure(paths: list[Path], arguments: argparse.Namespace) -> ExitStatus:
    """Prints the deviations of measured data from a run, or from other measured data."""
    from slipgrasp.cli.differences import describe_distances
    from slipgrasp.recordings.compare.measured import measure_distances
    from slipgrasp.recordings.measured.recording import is_measured, read_measured

    if arguments.figure is not None:
        raise CommandError("--figure draws two runs; one of these recordings is measured data")
    first, second = sorted(paths, key=lambda path: not is_measured(path))
    other = read_measured(second) if is_measured(second) else _read(second)
    found = measure_distances(read_measured(first), other)
    if arguments.json:
        print(json.dumps(found.to_mapping(), allow_nan=False))
    else:
        print(describe_distances(found))
    same = found.within(arguments.tolerance or 0.0)
    return ExitStatus.COMPLETED if same else ExitStatus.DIFFERENT


def _draw(
    comparison: Comparison, a: RunResult, b: RunResult, arguments: argparse.Namespace
) -> None:
    with Progress("drawing the figure"):
        from slipgrasp.figures.comparison import draw_comparison
        from slipgrasp.figures.files import write_figure

        names = Path(arguments.a).stem, Path(arguments.b).stem
        figure = draw_comparison(comparison, a, b, names)
        write_figure(figure, arguments.figure, overwrite=arguments.force)
