"""``slipgrasp prune``: list or delete stored runs by age, number or size."""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, data_directory, number_in, store_in
from slipgrasp.cli.serving import parse_size
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.recordings.store.stored_run import StoredRun
    from slipgrasp.recordings.study.retention import Expired, Retention

NAME = "prune"
HELP = "list old runs, or delete them"
DESCRIPTION = (
    "List the stored runs that the given rules do not retain; with --delete, delete them. At least "
    "one rule is required. Runs with a name, a tag or notes, results of studies, and recordings of "
    "unfinished studies are always retained. Recordings of finished studies are not: they can "
    "be computed again from the results."
)
MAX_DAYS = 36_500.0
MAX_RUNS = 999_999_999


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_retention(parser)
    parser.add_argument("--delete", action="store_true", help="delete the listed runs permanently")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_data_directory(parser)


def add_retention(parser: argparse._ActionsContainer) -> None:
    """Adds ``--keep-days``, ``--keep-runs`` and ``--keep-size`` to a parser or a group."""
    parser.add_argument(
        "--keep-days",
        metavar="DAYS",
        type=number_in(0.0, MAX_DAYS, "a number of days"),
        help="retain runs without a name, a tag or notes for this many days",
    )
    parser.add_argument(
        "--keep-runs",
        metavar="N",
        type=number_in(0, MAX_RUNS, "a number of runs", "allowed: 0 or more", of=int),
        help="retain only the newest N such runs",
    )
    parser.add_argument(
        "--keep-size",
        metavar="SIZE",
        type=parse_size,
        help="retain only the newest such runs, up to this total size, such as 5GB",
    )


def read_retention(arguments: argparse.Namespace) -> Retention:
    """The retention rules from the arguments of `add_retention`."""
    from slipgrasp.recordings.study.retention import Retention

    days = arguments.keep_days
    return Retention(
        max_age=None if days is None else timedelta(days=days),
        max_runs=arguments.keep_runs,
        max_bytes=arguments.keep_size,
    )


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    from slipgrasp.recordings.study.retention import TrustedClock, delete_expired, find_expired
    from slipgrasp.recordings.study.study_store import StudyStore

    retention = read_retention(arguments)
    if retention.keeps_all:
        raise CommandError("prune needs a rule: --keep-days, --keep-runs or --keep-size")
    folder = data_directory(arguments.data_directory)
    runs = store_in(folder)
    if retention.max_age is not None and (lag := TrustedClock(runs).lag()) > timedelta():
        complain(f"the newest run is {lag.days} days older than expected: is the clock right?")
    expired = find_expired(runs, StudyStore(folder, runs), retention, datetime.now(UTC))
    if arguments.delete:
        expired = delete_expired(runs, expired)
    print(_json(expired, arguments.delete) if arguments.json else _words(expired, arguments.delete))
    return ExitStatus.COMPLETED


def _words(expired: list[Expired], deleted: bool) -> str:
    lines = [
        f"{each.run.id}  {each.run.created[:10]}  {each.run.size / 1e6:9.2f} MB  "
        f"{each.rule:5}  {each.run.display_name}{_unknowns(each.run)}"
        for each in expired
    ]
    size = sum(each.run.size for each in expired) / 1e6
    amount = f"{len(expired)} runs, {size:.2f} MB"
    total = f"{amount} deleted" if deleted else f"{amount} to delete; use --delete"
    return "\n".join([*lines, total if expired else "no runs to delete"])


def _unknowns(run: StoredRun) -> str:
    """Names of the unknown parameters; empty if the run cannot be read."""
    from slipgrasp.core.words.knowledge_words import list_unknowns

    return f"  ({list_unknowns(run.summary['unknowns'])})" if run.summary else ""


def _json(expired: list[Expired], deleted: bool) -> str:
    runs = [
        {
            "id": each.run.id,
            "display_name": each.run.display_name,
            "created": each.run.created,
            "size": each.run.size,
            "rule": each.rule,
            "unknowns": each.run.summary.get("unknowns", []),
            "told": each.run.summary.get("told"),
        }
        for each in expired
    ]
    return json.dumps({"runs": runs, "deleted": deleted}, indent=2)
