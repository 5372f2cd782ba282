"""``slipgrasp serve``: the dashboard and the REST interface on one port of this machine."""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.arguments import (
    add_data_directory,
    data_directory,
    know_law,
    with_installed_laws,
)
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
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.web.model.given_hand import GivenHand


NAME = "serve"
HELP = "serve the dashboard"
DESCRIPTION = (
    "Serve the dashboard at / and the REST interface at /api/v1 until interrupted, by default "
    "only on this machine. The first line of standard output is the URL."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_port(parser)
    add_network(parser)
    add_data_directory(parser)
    add_limits(parser)
    add_executor(parser)
    add_retention(
        parser.add_argument_group(
            "retention",
            "By default no run is deleted. Runs that these rules do not retain are deleted at the "
            "start and then every hour: at the start, and by age also later, at most a tenth of "
            "all runs each time.",
        )
    )
    add_log_format(parser)
    add_metrics(parser)
    parser.add_argument(
        "--law",
        dest="laws",
        metavar="NAME|FILE.py:Name",
        action="append",
        default=[],
        help="custom law that clients can choose in addition to the built-in laws; may be repeated",
    )
    parser.add_argument(
        "--hand",
        metavar="FILE.toml",
        type=Path,
        help="file written by 'slipgrasp hands import', whose fingers are drawn with the meshes "
        "beside it; or a scenario file that names it, with which the dashboard then starts",
    )


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    for specification in arguments.laws:
        know_law(specification)
    folder = data_directory(arguments.data_directory)
    return serve_dashboard(
        arguments,
        folder,
        hand=None if arguments.hand is None else _given_hand(arguments.hand),
        study_executor=arguments.executor,
        metrics=arguments.metrics,
        retention=read_retention(arguments),
    )


def _given_hand(path: Path) -> GivenHand:
    """Reads the file of ``--hand``, and the meshes; without them the fingers are drawn as bars."""
    from slipgrasp.core.scenario.hand_files.meshes import load_meshes, meshes_file
    from slipgrasp.core.scenario.loading import load_scenario
    from slipgrasp.web.model.draft import Draft
    from slipgrasp.web.model.given_hand import GivenHand

    document = _document(path)
    draft, hand = None, document.get("hand")
    if document.keys() != {"fingers"}:
        scenario = with_installed_laws(lambda: load_scenario(path))
        draft = Draft.starting_from(f"file {path.name}", scenario)
    file = meshes_file(path.parent / hand if isinstance(hand, str) else path)
    if not file.is_file():
        complain(f"no meshes: '{file}' does not exist; 'slipgrasp hands import' writes it")
        return GivenHand(draft)
    meshes = load_meshes(file)
    if draft is not None and not meshes.fit(draft.base):
        raise CommandError(f"'{file}' has meshes of other fingers; import the hand again")
    return GivenHand(draft, meshes)


def _document(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else f"it is not TOML: {error}"
        raise CommandError(f"'{path}' cannot be read: {reason}") from error
