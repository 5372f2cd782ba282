"""``slipgrasp run``: simulate a scenario and keep the recording."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, store_in
from slipgrasp.cli.interrupt import Interrupt
from slipgrasp.cli.kernel import load_simulation
from slipgrasp.cli.progress import Progress
from slipgrasp.cli.scenarios import HelpWithParameters
from slipgrasp.cli.status import CommandError, ExitStatus, complain
from slipgrasp.cli.values import parse_assignments

if TYPE_CHECKING:
    from core.result import RunResult
    from core.scenario import Scenario

__all__ = ["add_command"]

DESCRIPTION = "Simulates a scenario, keeps the recording and tells what happened."
STATUSES = (
    "exit status: 0 completed, 3 ended early by physics, 2 bad input (nothing saved), "
    "4 any other early end (limit, interrupt, disk)"
)


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "run",
        help="simulate a scenario and keep the recording",
        description=DESCRIPTION,
        epilog=STATUSES,
        add_help=False,
    )
    parser.add_argument("-h", "--help", action=HelpWithParameters)
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a preset, or a TOML file")
    parser.add_argument(
        "--set",
        dest="assignments",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="set a parameter, such as object.mass=1.4; may be repeated; "
        "'none' removes an optional one",
    )
    parser.add_argument(
        "--output", metavar="FILE.mcap", type=Path, help="where to write the recording"
    )
    parser.add_argument("--force", action="store_true", help="replace an existing --output file")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")
    add_data_directory(parser)
    parser.set_defaults(execute=_execute)


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    scenario = _read_scenario(arguments.scenario, arguments.assignments)
    save = _prepare_saving(arguments)
    result = _simulate(scenario)
    result, recording = _save(result, save)
    if arguments.json:
        path = None if recording is None else str(recording)
        print(json.dumps({**result.summary(), "recording": path}, allow_nan=False))
    else:
        from slipgrasp.cli.summary import summarize

        print(summarize(result, recording))
    return ExitStatus.ENDED_EARLY if recording is None else ExitStatus.of(result.outcome)


def _read_scenario(source: str, assignments: list[str]) -> Scenario:
    from core.loading import load_scenario, parameter_definitions, with_values

    scenario = load_scenario(source)
    if not assignments:
        return scenario
    return with_values(scenario, parse_assignments(assignments, parameter_definitions(scenario)))


def _prepare_saving(arguments: argparse.Namespace) -> Callable[[RunResult], Path]:
    """Finds out before the simulation whether the result can be saved at all.

    Returns:
        What saves a result and tells where it is.
    """
    if arguments.output is None:
        store = store_in(arguments.data_directory)
        store.prepare()
        return lambda result: store.save(result).path.absolute()
    output: Path = arguments.output.absolute()
    _check_output(output, arguments.force)
    return partial(_write, output=output, overwrite=arguments.force)


def _check_output(output: Path, force: bool) -> None:
    from recordings.exceptions import RecordingExistsError

    if output.is_dir():
        raise CommandError(f"--output '{output}' is a folder; give the name of a file")
    if not output.parent.is_dir():
        raise CommandError(f"--output '{output}': there is no folder '{output.parent}'")
    if not os.access(output.parent, os.W_OK | os.X_OK):
        raise CommandError(f"--output '{output}': no permission to write in that folder")
    if output.exists() and not force:
        raise RecordingExistsError(output)


def _write(result: RunResult, output: Path, overwrite: bool) -> Path:
    from recordings.writer import write_recording

    write_recording(result, output, overwrite=overwrite)
    return output


def _simulate(scenario: Scenario) -> RunResult:
    from core.simulator import simulate

    load_simulation()
    with Interrupt() as interrupt, Progress("simulating") as progress:
        return simulate(scenario, progress=progress.update, should_stop=lambda: interrupt.requested)


def _save(result: RunResult, save: Callable[[RunResult], Path]) -> tuple[RunResult, Path | None]:
    """Saves a result; where the disk fails it is still told, with a warning more."""
    from core.types import RunWarning
    from recordings.exceptions import RecordingError

    try:
        return result, save(result)
    except RecordingError as error:
        complain(f"the run is not saved: {error}")
        warning = RunWarning(
            code="not_saved", message=str(error), count=1, first_time=result.end_time
        )
        return replace(result, warnings=(*result.warnings, warning)), None
