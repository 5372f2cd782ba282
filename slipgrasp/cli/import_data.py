"""``slipgrasp import``: measured data as a recording."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, store_in
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.recordings.measured.csv_import import ImportOptions
    from slipgrasp.recordings.measured.recording import MeasuredOutline

NAME = "import"
HELP = "make a recording of measured data"
DESCRIPTION = (
    "Turn measured data (CSV) into a recording (docs/fit.md). Nothing is simulated. Signals "
    "are named like the columns of runs, such as x, theta, slip_0 or normal_force_1, and are "
    "converted to SI units according to the unit after the colon in --map, or the end of the "
    "column name (x_mm, yaw_deg, vx_m_s, 'F [N]'). 'slipgrasp diff' compares such recordings with "
    "runs, and 'slipgrasp export' writes them as tables."
)
EPILOG = "exit status: 0 imported, 2 bad input, 4 disk failure"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("table", metavar="DATA.csv", type=Path, help="table with a header line")
    add_map(parser, required=True)
    parser.add_argument(
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="recording to write (default: a new one in the data folder)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_data_directory(parser)


def add_map(parser: argparse.ArgumentParser, *, required: bool = False) -> None:
    """Adds the options for reading a table."""
    group = parser.add_argument_group("tables (CSV)")
    group.add_argument(
        "--map",
        dest="mapping",
        metavar="SIGNAL=COLUMN[:UNIT]",
        action="append",
        default=[],
        required=required,
        help="a signal and its column, such as slip_0=s0:mm; may be repeated, or list several "
        "separated by commas; t=COLUMN is the time (default: the column t or time)",
    )
    group.add_argument(
        "--rate", metavar="HZ", type=float, help="sampling rate if there is no time column"
    )
    group.add_argument(
        "--start",
        metavar="T",
        type=float,
        help="time of the first sample [s] (default: as in the table)",
    )
    group.add_argument(
        "--every", metavar="N", type=int, default=1, help="use only every Nth sample"
    )
    group.add_argument(
        "--gap",
        metavar="T",
        type=float,
        help="mark longer intervals as gaps [s] (default: 2.5 times the median interval)",
    )
    group.add_argument(
        "--skip-missing",
        action="store_true",
        help="skip rows with missing values instead of rejecting the table",
    )
    group.add_argument("--title", metavar="TEXT", default="", help="title of the recording")


def read_options(arguments: argparse.Namespace) -> ImportOptions:
    """The options for reading a table, from the arguments of `add_map`.

    Raises:
        CommandError: If a mapping is malformed.
    """
    from slipgrasp.recordings.measured.csv_import import ImportOptions

    mapping: dict[str, str] = {}
    for text in (part for each in arguments.mapping for part in each.split(",")):
        name, equals, column = (part.strip() for part in text.partition("="))
        if not (name and equals and column):
            message = f"--map needs SIGNAL=COLUMN, such as slip_0=s0:mm, not '{text[:80]}'"
            raise CommandError(message)
        if name in mapping:
            raise CommandError(f"--map gives {name[:60]} twice; remove one")
        mapping[name] = column
    return ImportOptions(
        mapping=mapping,
        rate=arguments.rate,
        start=arguments.start,
        every=arguments.every,
        longest_interval=arguments.gap,
        skip_missing=arguments.skip_missing,
        title=arguments.title,
    )


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    options = read_options(arguments)
    with Progress(f"reading {arguments.table.name}"):
        outline, path, run_id = _import(arguments, options)
    if arguments.json:
        place = {"recording": str(path), "id": run_id}
        print(json.dumps({**outline.to_mapping(), **place}, allow_nan=False))
    else:
        print(outline.text)
        for column in outline.columns:
            print(f"  {column.name:<24} {column.unit:<6} from {column.source}")
        print(f"recording  {path}")
    return ExitStatus.COMPLETED


def _import(
    arguments: argparse.Namespace, options: ImportOptions
) -> tuple[MeasuredOutline, Path, str | None]:
    from slipgrasp.recordings.measured.csv_import import import_csv

    if arguments.output is not None:
        path = arguments.output.absolute()
        return import_csv(arguments.table, path, options, overwrite=arguments.force), path, None
    store = store_in(arguments.data_directory)
    reservation = store.reserve()
    outline = import_csv(arguments.table, reservation.path, options)
    store.register_measured(reservation, outline)
    return outline, reservation.path.absolute(), reservation.id
