"""``slipgrasp replay``: open a recording in the dashboard."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, data_directory, names_a_file, store_in
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.serving import (
    add_limits,
    add_log_format,
    add_network,
    add_port,
    serve_dashboard,
)
from slipgrasp.cli.status import ExitStatus

if TYPE_CHECKING:
    from slipgrasp.web.model.replay import Source


NAME = "replay"
HELP = "open a recording in the dashboard"
DESCRIPTION = (
    "Open a recording in the dashboard, and serve it until interrupted, by default only on this "
    "machine. Nothing is simulated until a control is moved. The first line of standard output "
    "is the URL."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "recording",
        metavar="FILE.mcap|ID",
        help="the recording, or the id of a stored run; a file that is still being written is "
        "shown up to its last complete chunk",
    )
    add_port(parser, default=0)
    add_network(parser)
    add_data_directory(parser)
    add_limits(parser)
    add_log_format(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    folder = data_directory(arguments.data_directory)
    source = _source(arguments.recording)
    _check(source, folder)
    return serve_dashboard(arguments, folder, source)


def _source(text: str) -> Source:
    return Path(text).absolute() if names_a_file(text) else text


def _check(source: Source, folder: Path) -> None:
    """Reads the recording once, so that its errors are reported before the server starts."""
    from slipgrasp.web.model.replay import open_replay

    with Progress("reading the recording"):
        open_replay(store_in(folder), source)
