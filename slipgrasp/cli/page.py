"""``slipgrasp page``: one HTML file that simulates a scenario in a browser, without a network."""

from __future__ import annotations

import argparse
import io
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_scenario, read_scenario
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.scenario import Scenario

RECORDING_SUFFIX = ".mcap"
DESCRIPTION = (
    "Write one HTML file that simulates a scenario in the browser: it needs no server, no "
    "network and no installation, and shows the SHA-256 of its run, which 'slipgrasp run --json' "
    "prints too. SCENARIO may also be a recording (FILE.mcap), whose scenario is simulated again."
)
EPILOG = (
    "The first use compiles the kernel to WebAssembly, which takes a minute and needs "
    "'pip install slipgrasp[wasm]'. Exit status: 0 written, 2 bad input."
)


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "page",
        help="write one HTML file that simulates a scenario in a browser",
        description=DESCRIPTION,
        epilog=EPILOG,
        add_help=False,
    )
    add_scenario(parser)
    parser.add_argument(
        "--output", metavar="FILE.html", type=Path, required=True, help="file to write"
    )
    parser.add_argument(
        "--controls",
        metavar="KEY,KEY,…",
        type=lambda text: [word.strip() for word in text.split(",") if word.strip()],
        help="parameters with sliders, fingers.*.KEY for all fingers at once (default: "
        "object.mass,fingers.*.friction and, for planar hands, controller.position_gain)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing file")
    parser.set_defaults(execute=_execute)


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    output: Path = arguments.output
    _check_output(output, arguments.force)
    scenario, command = _scenario_of(arguments)
    load_simulation(scenario.space)
    with Progress("loading the dashboard"):
        from slipgrasp.web.standalone.controls import usual_controls
        from slipgrasp.web.standalone.page_file import write_page
    content = io.BytesIO()
    with Progress("writing the page"):
        controls = usual_controls(scenario) if arguments.controls is None else arguments.controls
        result = write_page(scenario, content, controls, command)
    output.write_bytes(content.getvalue())
    print(f"{output}: {len(content.getvalue()) / 1e6:.2f} MB, SHA-256 of its run {result.sha256}")
    return ExitStatus.COMPLETED


def _scenario_of(arguments: argparse.Namespace) -> tuple[Scenario, str]:
    """The scenario, and the command that runs it; no command for a recording."""
    path = Path(arguments.scenario)
    if path.suffix.lower() != RECORDING_SUFFIX:
        words = ["slipgrasp", "run", arguments.scenario]
        words += ["--law", arguments.law] if arguments.law else []
        words += [word for each in arguments.assignments for word in ("--set", each)]
        return read_scenario(arguments), shlex.join(words)
    if arguments.law or arguments.assignments:
        raise CommandError("--law and --set need a preset or a TOML file, not a recording")
    from slipgrasp.recordings.file.reader import read_recording

    with Progress("reading the recording"):
        return read_recording(path).scenario, ""


def _check_output(output: Path, force: bool) -> None:
    if output.is_dir() or not output.parent.is_dir():
        raise CommandError(f"--output '{output}': give the name of a file in an existing folder")
    if not os.access(output.parent, os.W_OK | os.X_OK):
        raise CommandError(f"--output '{output}': no permission to write in that folder")
    if output.exists() and not force:
        raise CommandError(f"'{output}' exists; --force replaces it")
