"""``slipgrasp recover``: recover the content of a damaged or unfinished recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from slipgrasp.cli.progress import Progress
from slipgrasp.cli.status import ExitStatus

NAME = "recover"
HELP = "recover the content of a damaged recording"
DESCRIPTION = (
    "Write the intact beginning of a damaged or unfinished recording as a complete recording. Its "
    "outcome is 'recovered', unless only the index was missing. The original is not changed."
)
EPILOG = "exit status: 0 recovered, 2 nothing to recover"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("recording", metavar="FILE", type=Path, help="the damaged recording")
    parser.add_argument(
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="file to write (default: NAME.mcap for NAME.mcap.part, "
        "NAME.recovered.mcap for NAME.mcap)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    from slipgrasp.recordings.file.recovery import recover, recovered_name

    source: Path = arguments.recording
    output: Path = arguments.output or recovered_name(source)
    with Progress("reading the recording"):
        recovered = recover(source, output, overwrite=arguments.force)
    result = recovered.result
    print(f"{len(result.trace)} samples up to {result.end_time:.6g} s recovered: {recovered.path}")
    if recovered.lost_bytes:
        print(f"the last {recovered.lost_bytes} bytes of '{source}' could not be used")
    return ExitStatus.COMPLETED
