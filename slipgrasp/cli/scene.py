"""``slipgrasp scene``: the same grasp for another engine, with the answer to expect."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from slipgrasp.cli.arguments import add_scenario, check_output, read_scenario
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import ExitStatus

DESCRIPTION = (
    "Write the grasp of a scenario as a scene of another engine, and the expected answer beside it "
    "as JSON: joint torques for each step, and at stated times slip and forces, the phase changes, "
    "the creep in stick (zero) and the tolerance within which the engine reproduces the slip."
)
EPILOG = "exit status: 0 written, 2 bad input"


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "scene",
        help="write a scenario as a scene of another engine, with the answer to expect",
        description=DESCRIPTION,
        epilog=EPILOG,
        add_help=False,
    )
    add_scenario(parser)
    parser.add_argument(
        "--format", choices=["mjcf"], default="mjcf", help="mjcf: MuJoCo 3.3 or later"
    )
    parser.add_argument(
        "--output",
        metavar="FILE.xml",
        type=Path,
        required=True,
        help="file to write; the answer goes into FILE.json",
    )
    parser.add_argument("--force", action="store_true", help="replace existing files")
    parser.set_defaults(execute=_execute)


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    scene: Path = arguments.output
    answer = scene.with_suffix(".json")
    for each in (scene, answer):
        check_output(each, arguments.force)
    scenario = read_scenario(arguments)
    load_simulation(scenario)
    from slipgrasp.recordings.engines.expected import DURATION, expected_answer, record_densely
    from slipgrasp.recordings.engines.mjcf import check_for_scene, contacts_of, write_scene

    check_for_scene(scenario)
    with Progress("simulating"):
        result = record_densely(scenario, min(DURATION, scenario.simulation.duration))
    content = {**expected_answer(result), "contacts": contacts_of(scenario)}
    scene.write_text(write_scene(result), encoding="utf-8")
    answer.write_text(json.dumps(content), encoding="utf-8")
    tolerance = 1e6 * content["tolerance"]["slip"]
    print(f"{scene}: the scene; {answer}: the expected answer, slips within {tolerance:.0f} µm")
    return ExitStatus.COMPLETED
