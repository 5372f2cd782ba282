"""``slipgrasp scene``: the same grasp for another engine, with the expected motion."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from slipgrasp.cli.arguments import add_scenario, check_output, read_scenario
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus

NAME = "scene"
HELP = "write a scenario as a scene of another engine, with the expected result"
DESCRIPTION = (
    "Write the grasp of a scenario as a scene of another engine, and the expected result beside it "
    "as JSON: joint torques for each step, slip and forces at given times, phase changes, creep in "
    "stick (zero), and the tolerance within which the engine reproduces the slip. "
    "USD files have not been simulated in any engine, so no tolerance is given."
)
EPILOG = "exit status: 0 written, 2 bad input"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_scenario(parser)
    parser.add_argument(
        "--format",
        choices=["mjcf", "drake", "usd"],
        default="mjcf",
        help="mjcf: MuJoCo 3.3 or later (default); drake: SDFormat for Drake, tested with "
        "1.51; usd: UsdPhysics as text, checked as a file, but not simulated",
    )
    parser.add_argument(
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help="file to write, such as hold.xml, hold.sdf or hold.usda; the expected result is "
        "written beside it, with the suffix .json",
    )
    parser.add_argument("--force", action="store_true", help="replace existing files")


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    scene: Path = arguments.output
    answer = scene.with_suffix(".json")
    if scene == answer:
        raise CommandError(
            f"--output '{scene}': the expected result is written there; use another suffix"
        )
    for each in (scene, answer):
        check_output(each, arguments.force)
    scenario = read_scenario(arguments)
    load_simulation(scenario)
    from slipgrasp.recordings.engines.bodies import check_for_scene
    from slipgrasp.recordings.engines.expected import DURATION, record_densely
    from slipgrasp.recordings.engines.formats import describe

    check_for_scene(scenario)
    with Progress("simulating"):
        result = record_densely(scenario, min(DURATION, scenario.simulation.duration))
    text, content = describe(result, arguments.format)
    scene.write_text(text, encoding="utf-8")
    answer.write_text(json.dumps(content), encoding="utf-8")
    known = "not simulated"
    if "tolerance" in content:
        known = f"slips within {1e6 * content['tolerance']['slip']:.0f} µm"
    print(f"{scene}: the scene; {answer}: the expected result, {known}")
    return ExitStatus.COMPLETED
