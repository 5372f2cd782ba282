"""``slipgrasp page``: a live page, which simulates a scenario in a browser without a network."""

from __future__ import annotations

import argparse
import io
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_scenario, check_output, read_scenario
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.scenario import Scenario

RECORDING_SUFFIX = ".mcap"
WHY = "why"
NAME = "page"
HELP = "write a live page: one HTML file that simulates a scenario"
DESCRIPTION = (
    "Write a live page: one HTML file that simulates a scenario in a browser. It needs no "
    "server, no network and no installation, and shows the SHA-256 of its run, which 'slipgrasp "
    "run --json' prints too. SCENARIO can also be a recording (FILE.mcap), whose scenario is "
    "simulated again, or 'why': the page 'Why does my object slip?', which asks for five "
    "numbers of a gripper."
)
EPILOG = (
    "The first use compiles the kernel to WebAssembly, which takes a minute or two and needs "
    "pip install 'slipgrasp[wasm]'. Exit status: 0 written, 2 bad input."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_scenario(parser, "name of a preset, a TOML file, a recording (FILE.mcap), or 'why'")
    parser.add_argument(
        "--output", metavar="FILE.html", type=Path, required=True, help="file to write"
    )
    parser.add_argument(
        "--controls",
        metavar="KEY[=LOW:HIGH],…",
        type=lambda text: [word.strip() for word in text.split(",") if word.strip()],
        help="parameters with sliders, fingers.*.KEY for all fingers at once; LOW and HIGH are the "
        "ends of a slider (default: "
        "object.mass,fingers.*.friction and, for planar hands, controller.position_gain)",
    )
    parser.add_argument(
        "--shared",
        action="store_true",
        help="store the parts common to all pages in separate files in the same folder, for a site "
        "of many pages",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing file")


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    output: Path = arguments.output
    check_output(output, arguments.force)
    if arguments.scenario == WHY:
        return _write_questions(output)
    scenario, command = _scenario_of(arguments)
    load_simulation(scenario)
    with Progress("simulating"):
        from slipgrasp.core.run.simulator import simulate

        result = simulate(scenario)
    written = write_page_of(result, output, arguments.controls, command, shared=arguments.shared)
    print(written)
    return ExitStatus.COMPLETED


def write_page_of(
    result: RunResult,
    output: Path,
    controls: Sequence[str] | None,
    command: str,
    *,
    shared: bool = False,
) -> str:
    """Writes the page of a run.

    Args:
        result: The run.
        output: The file to write.
        controls: Keys of the parameters with sliders; None for the defaults.
        command: Command line of the same simulation; empty if there is none.
        shared: Whether common parts of pages are written to separate files.

    Returns:
        Description of the written files.
    """
    with Progress("loading the dashboard"):
        from slipgrasp.web.standalone.controls import usual_controls
        from slipgrasp.web.standalone.page_file import share_in, write_page
    content = io.BytesIO()
    with Progress("writing the page"):
        chosen = usual_controls(result.scenario) if controls is None else controls
        share = share_in(output.parent) if shared else str
        write_page(result, content, chosen, command, share)
    output.write_bytes(content.getvalue())
    size = len(content.getvalue()) / 1e6
    return f"{output}: {size:.2f} MB, SHA-256 of its run {result.sha256}"


def _write_questions(output: Path) -> ExitStatus:
    from slipgrasp.web.standalone.grip_page import grip_page

    output.write_text(grip_page(), encoding="utf-8")
    print(f"{output}: why does my object slip?")
    return ExitStatus.COMPLETED


def _scenario_of(arguments: argparse.Namespace) -> tuple[Scenario, str]:
    """The scenario, and the command that runs it; no command for a recording."""
    path = Path(arguments.scenario)
    if path.suffix.lower() != RECORDING_SUFFIX:
        return read_scenario(arguments), command_of(arguments)
    if arguments.law or arguments.assignments:
        raise CommandError("--law and --set need a preset or a TOML file, not a recording")
    from slipgrasp.recordings.file.reader import read_recording

    with Progress("reading the recording"):
        return read_recording(path).scenario, ""


def command_of(arguments: argparse.Namespace, name: str = "run") -> str:
    """A command, such as ``run``, on the scenario of the arguments of `add_scenario`."""
    words = ["slipgrasp", name, arguments.scenario]
    words += ["--law", arguments.law] if arguments.law else []
    words += [word for each in arguments.assignments for word in ("--set", each)]
    return shlex.join(words)
