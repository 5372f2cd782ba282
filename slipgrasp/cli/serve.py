"""``slipgrasp serve``: the dashboard and the REST interface on one port of this machine."""

from __future__ import annotations

import argparse

from slipgrasp.cli.arguments import add_data_directory, data_directory, know_law
from slipgrasp.cli.prune import add_retention, read_retention
from slipgrasp.cli.serving import (
    add_executor,
    add_limits,
    add_log_format,
    add_metrics,
    add_network,
    add_port,
    serve_dashboard,
)
from slipgrasp.cli.status import ExitStatus


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "serve",
        help="serve the dashboard",
        description="Serve the dashboard at / and the REST interface at /api/v1 to this machine "
        "until interrupted. The first line of standard output is the URL.",
    )
    add_port(parser)
    add_network(parser)
    add_data_directory(parser)
    add_limits(parser)
    add_executor(parser)
    add_retention(parser)
    add_log_format(parser)
    add_metrics(parser)
    parser.add_argument(
        "--law",
        dest="laws",
        metavar="NAME|FILE.py:Name",
        action="append",
        default=[],
        help="offer this custom law to clients, which can choose no other custom laws; may be "
        "repeated",
    )
    parser.set_defaults(execute=_execute)


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    for specification in arguments.laws:
        know_law(specification)
    folder = data_directory(arguments.data_directory)
    return serve_dashboard(
        arguments,
        folder,
        study_executor=arguments.executor,
        metrics=arguments.metrics,
        retention=read_retention(arguments),
    )
