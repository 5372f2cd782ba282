"""``slipgrasp run``: simulate a scenario and store the recording."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import (
    add_data_directory,
    add_scenario,
    check_output,
    number_in,
    read_scenario,
    refuse_existing,
    store_in,
)
from slipgrasp.cli.interrupt import Interrupt
from slipgrasp.cli.page import command_of, write_page_of
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.run.trying import TriedHint
    from slipgrasp.core.scenario import Scenario

NAME = "run"
HELP = "simulate a scenario and store the recording"
DESCRIPTION = "Simulate a scenario, store the recording, and print the outcome."
MAX_DISPLAY_RATE = 1000.0
TRYING_LIMIT = 5.0  # [s]; the suggestions are tried within a second on most machines
EPILOG = (
    "exit status: 0 completed, 2 bad input (nothing saved), 3 ended early for a physical reason, "
    "4 any other early end (limit, interrupt, disk)"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_scenario(parser)
    parser.add_argument(
        "--output",
        metavar="FILE.mcap",
        type=Path,
        help="file to write (default: a new run in the data folder)",
    )
    parser.add_argument(
        "--page",
        metavar="FILE.html",
        type=Path,
        help="also write a live page of the scenario ('slipgrasp page')",
    )
    parser.add_argument("--force", action="store_true", help="replace existing files")
    parser.add_argument(
        "--display-rate",
        metavar="HZ",
        type=number_in(0.0, MAX_DISPLAY_RATE, "a display rate", "allowed: 0 … 1000 Hz"),
        help="rate at which the recording shows hand and object in Foxglove and Rerun, "
        f"0 for never (default: 50, at most {MAX_DISPLAY_RATE:g})",
    )
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")
    add_data_directory(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    scenario = read_scenario(arguments)
    if arguments.page is not None:
        check_output(arguments.page, arguments.force, "--page")
    place = _find_place(arguments)
    result, recording = _simulate(scenario, place, arguments.display_rate)
    if arguments.json:
        path = None if recording is None else str(recording)
        document = {**result.summary(), "sha256": result.sha256, "recording": path}
        print(json.dumps(document, allow_nan=False))
    else:
        from slipgrasp.cli.summary import summarize

        told = summarize(result, recording, _try_hint(result))
        print(told.replace("slipgrasp margin SCENARIO", command_of(arguments, "margin")))
    if arguments.page is not None:
        written = write_page_of(result, arguments.page, None, command_of(arguments))
        print(written, file=sys.stderr if arguments.json else sys.stdout)
    return ExitStatus.ENDED_EARLY if recording is None else ExitStatus.of(result.outcome)


def _try_hint(result: RunResult) -> TriedHint:
    """Tries the suggestions of the hint, for a limited time."""
    from slipgrasp.core.awake_clock import AwakeClock
    from slipgrasp.core.run.trying import try_hint
    from slipgrasp.core.run.verdict import describe_run

    clock = AwakeClock()
    with Interrupt() as interrupt, Progress("trying suggestions"):
        return try_hint(
            result,
            describe_run(result).hint,
            should_stop=lambda: interrupt.requested or clock.read() > TRYING_LIMIT,
        )


@dataclass(frozen=True, slots=True)
class _Place:
    """The destination of a recording, and the action after it is written."""

    path: Path
    overwrite: bool
    register: Callable[[RunResult], object]


def _find_place(arguments: argparse.Namespace) -> _Place:
    """Checks before the simulation whether the result can be saved."""
    if arguments.output is None:
        store = store_in(arguments.data_directory)
        store.prepare()
        reservation = store.reserve()
        return _Place(reservation.path.absolute(), False, partial(store.register, reservation))
    output: Path = arguments.output.absolute()
    _check_output(output, arguments.force)
    return _Place(output, arguments.force, lambda result: None)


def _check_output(output: Path, force: bool) -> None:
    if output.is_dir():
        raise CommandError(f"--output '{output}' is a folder; give the name of a file")
    if not output.parent.is_dir():
        raise CommandError(f"--output '{output}': there is no folder '{output.parent}'")
    if not os.access(output.parent, os.W_OK | os.X_OK):
        raise CommandError(f"--output '{output}': no permission to write in that folder")
    refuse_existing(output, force)


def _simulate(
    scenario: Scenario, place: _Place, display_rate: float | None
) -> tuple[RunResult, Path | None]:
    """Simulates and records; if the disk fails, the result is still printed, with a warning."""
    from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE
    from slipgrasp.recordings.file.recorder import record

    load_simulation(scenario)
    with Interrupt() as interrupt, Progress("simulating") as progress:
        recorded = record(
            scenario,
            place.path,
            overwrite=place.overwrite,
            display_rate=DISPLAY_RATE if display_rate is None else display_rate,
            progress=progress.update,
            should_stop=lambda: interrupt.requested,
        )
    if recorded.failure is None:
        place.register(recorded.result)
        return recorded.result, place.path
    complain(f"the run is not saved: {recorded.failure}")
    return recorded.result, None
