"""``slipgrasp hands``: makes a scenario with the fingers of a hand that a URDF file describes."""

from __future__ import annotations

import argparse
from pathlib import Path

from slipgrasp.cli.status import CommandError, ExitStatus

_MOST_BYTES = 10_000_000


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    text = "make a scenario with the fingers of a hand from its URDF file"
    parser = commands.add_parser("hands", help=text, description=f"{text.capitalize()}.")
    parts = parser.add_subparsers(metavar="COMMAND", required=True)
    command = parts.add_parser(
        "import",
        help="from a URDF file",
        description="Reads what lies between the base of a hand and its fingertips, joins links "
        "that are fixed to each other, and writes a scenario whose fingers are built so. Each "
        "finger has three moving joints; others are locked.",
    )
    command.add_argument("file", metavar="FILE.urdf", type=Path, help="description of the hand")
    command.add_argument(
        "--tips",
        metavar="LINK",
        nargs="+",
        required=True,
        help="links whose origins are the fingertips, in the order of the fingers of the scenario",
    )
    command.add_argument(
        "--scenario",
        metavar="NAME",
        required=True,
        help="preset or TOML file of a spatial hand: object, faces, friction, motion and law",
    )
    command.add_argument(
        "--output", metavar="FILE.toml", type=Path, required=True, help="where it is written"
    )
    command.add_argument(
        "--base",
        metavar=("X", "Y", "Z", "ROLL", "PITCH", "YAW"),
        nargs=6,
        type=float,
        default=(0.0,) * 6,
        help="pose of the hand's base in the world [m, rad] (default: all 0)",
    )
    command.add_argument(
        "--lock",
        metavar="JOINT=POSITION",
        action="append",
        default=[],
        help="a joint that does not move, and where it stands [rad, m]",
    )
    command.set_defaults(execute=_import)


def _import(arguments: argparse.Namespace) -> ExitStatus:
    import numpy as np

    from slipgrasp.core.scenario import SpatialScenario
    from slipgrasp.core.scenario.loading import (
        load_scenario,
        scenario_from_mapping,
        scenario_to_toml,
    )
    from slipgrasp.core.scenario.urdf import Description, pose_of, with_fingers

    scenario = load_scenario(arguments.scenario)
    if not isinstance(scenario, SpatialScenario):
        raise CommandError(f"'{arguments.scenario}' is of a planar hand; give a spatial one")
    hand = Description(_text_of(arguments.file), dict(map(_locked, arguments.lock)))
    fingers = [hand.finger(tip) for tip in arguments.tips]
    base = pose_of(np.array(arguments.base[:3]), np.array(arguments.base[3:]))
    made = scenario_from_mapping(with_fingers(scenario, fingers, base))
    try:
        with arguments.output.open("x", encoding="utf-8") as stream:
            stream.write(scenario_to_toml(made))
    except FileExistsError:
        raise CommandError(f"'{arguments.output}' exists; choose another name") from None
    except OSError as error:
        raise CommandError(f"'{arguments.output}' cannot be written: {error.strerror}") from error
    used = frozenset().union(*(finger.links for finger in fingers))
    left = ", ".join(sorted(hand.links - used)) or "none"
    print(f"{arguments.output}: {len(fingers)} fingers; links that move with none of them: {left}")
    return ExitStatus.COMPLETED


def _text_of(file: Path) -> str:
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise CommandError(f"'{file}' is larger than {_MOST_BYTES // 1_000_000} MB")
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise CommandError(f"'{file}' cannot be read: {reason}") from error


def _locked(text: str) -> tuple[str, float]:
    name, _, position = text.partition("=")
    try:
        return name, float(position)
    except ValueError:
        raise CommandError(f"--lock {text}: give JOINT=POSITION, such as joint_0=0.1") from None
