"""``slipgrasp hands``: the fingers of a hand that a URDF or MJCF file describes, for scenarios."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import write_new
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.core.scenario.hand_files.description import (
        Body,
        Description,
        Follows,
        ImportedFinger,
        Joint,
        Pose,
    )
    from slipgrasp.core.scenario.hand_files.visuals import Visuals

NAME = "hands"
HELP = "make the fingers of a scenario from the URDF or MJCF file of a hand"
DESCRIPTION = "Make the fingers of a scenario from the URDF or MJCF file of a hand."
_MOST_BYTES = 10_000_000
_COUPLING = "JOINT=LEADER,RATIO[,OFFSET]"
_USE = """\
The fingers of {file}, written by `slipgrasp hands import`. To use them, add the line
    hand = "{name}"
above the tables of a scenario file of a spatial hand in this folder, and as many [[fingers]], each
with its face and friction.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parts = parser.add_subparsers(metavar="COMMAND", required=True)
    command = parts.add_parser(
        "import",
        help="read the fingers from a URDF or MJCF file",
        description="Read the joints and links from the base of a hand to its fingertips, merge "
        "links that are fixed to each other, and write the fingers as TOML. A scenario file in "
        "the same folder uses the result with the line 'hand = \"FILE.toml\"'; --scenario writes "
        "a complete scenario instead. Three joints of each finger are independent; lock the "
        "others, or couple them to these. The visible shapes are written to FILE.meshes.npz, with "
        "which 'slipgrasp serve --hand FILE.toml' draws them.",
    )
    command.add_argument("file", metavar="HAND", type=Path, help="URDF or MJCF file of the hand")
    command.add_argument(
        "--tips",
        metavar="LINK",
        nargs="+",
        required=True,
        help="links (URDF), bodies or sites (MJCF) whose origins are the fingertips, in the order "
        "of the fingers of the scenario",
    )
    command.add_argument(
        "--scenario",
        metavar="NAME",
        help="preset or TOML file of a spatial hand, which provides object, faces, friction, "
        "motion and law",
    )
    command.add_argument(
        "--output", metavar="FILE.toml", type=Path, required=True, help="file to write"
    )
    _add_options(command)


def _add_options(command: argparse.ArgumentParser) -> None:
    """Adds what the file does not say: pose of the base, fixed and coupled joints, packages."""
    command.add_argument(
        "--base-pose",
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
        help="lock a joint at a position [rad, m]; may be repeated",
    )
    command.add_argument(
        "--couple",
        metavar=_COUPLING,
        action="append",
        default=[],
        help="let a joint follow another one, as mimic joints of a URDF file and joint equalities "
        "of an MJCF file do: its position is RATIO times that of LEADER, plus OFFSET; may be "
        "repeated",
    )
    command.add_argument(
        "--packages",
        metavar="FOLDER",
        type=Path,
        action="append",
        default=[],
        help="folder of the packages that the URDF file names with package://, in addition to all "
        "folders above that file; may be repeated",
    )


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    import numpy as np

    from slipgrasp.core.scenario.hand_files.description import Description, pose_of

    locked, coupled = map(_locked, arguments.lock), map(_coupled, arguments.couple)
    hand = Description(*_read(arguments), dict(locked), dict(coupled))
    fingers = [hand.finger(tip) for tip in arguments.tips]
    base = pose_of(np.array(arguments.base_pose[:3]), np.array(arguments.base_pose[3:]))
    if arguments.scenario is None:
        text = _hand_toml(arguments, fingers, base)
    else:
        text = _scenario_toml(arguments.scenario, fingers, base)
    write_new(arguments.output, text)
    _report(arguments, hand, fingers)
    _write_meshes(arguments, hand, fingers)
    return ExitStatus.COMPLETED


def _read(arguments: argparse.Namespace) -> tuple[dict[str, Body], list[Joint]]:
    """Links and joints of the file, which is MJCF if its root element is that of MJCF."""
    from slipgrasp.core.scenario.hand_files.mjcf import read_mjcf
    from slipgrasp.core.scenario.hand_files.urdf import read_urdf

    text = _text_of(arguments.file)
    return read_mjcf(arguments.file, arguments.tips) if "<mujoco" in text else read_urdf(text)


def _hand_toml(arguments: argparse.Namespace, fingers: Sequence[ImportedFinger], base: Pose) -> str:
    """The text of a hand file, which contains only fingers."""
    from slipgrasp.core.scenario.hand_files.description import finger_mapping
    from slipgrasp.core.scenario.loading import fingers_to_toml

    use = _USE.format(file=arguments.file.name, name=arguments.output.name)
    comment = "".join(f"# {line}\n" for line in use.splitlines())
    return comment + fingers_to_toml([finger_mapping(finger, base) for finger in fingers])


def _scenario_toml(name: str, fingers: Sequence[ImportedFinger], base: Pose) -> str:
    """The TOML text of a scenario with these fingers."""
    from slipgrasp.core.scenario import SpatialScenario
    from slipgrasp.core.scenario.hand_files.description import with_fingers
    from slipgrasp.core.scenario.loading import (
        load_scenario,
        scenario_from_mapping,
        scenario_to_toml,
    )

    scenario = load_scenario(name)
    if not isinstance(scenario, SpatialScenario):
        raise CommandError(f"'{name}' has a planar hand; choose one with a spatial hand")
    return scenario_to_toml(scenario_from_mapping(with_fingers(scenario, fingers, base)))


def _report(
    arguments: argparse.Namespace, hand: Description, fingers: Sequence[ImportedFinger]
) -> None:
    """Prints the merged links and the omitted ones."""
    parts = [names for finger in fingers for names in finger.parts]
    joined = "; ".join(f"{first} with {', '.join(rest)}" for first, *rest in parts if rest)
    left = ", ".join(sorted(hand.links.difference(*parts)))
    print(f"Wrote {arguments.output} with {len(fingers)} fingers.")
    print(f"merged, since they move together: {joined or 'none'}")
    print(f"omitted, since they belong to no finger: {left or 'none'}")
    if arguments.scenario is None:
        name = arguments.output.name
        print(
            f"to use it: add 'hand = \"{name}\"' above the tables of a scenario file in its folder"
        )


def _write_meshes(
    arguments: argparse.Namespace, hand: Description, fingers: Sequence[ImportedFinger]
) -> None:
    """Writes the visible shapes beside the output; a hand is complete without them."""
    from slipgrasp.core.exceptions import ScenarioError
    from slipgrasp.core.scenario.hand_files.meshes import meshes_file
    from slipgrasp.core.scenario.hand_files.visuals import meshes_of

    file = meshes_file(arguments.output)
    try:
        meshes = meshes_of(hand, fingers, _visuals(arguments))
        if meshes is None:
            print("meshes: none, since the file has no visible shapes of these links")
            return
        meshes.save(file)
    except ScenarioError as error:
        complain(f"no meshes written: {error}")
    except OSError as error:
        complain(f"no meshes written: '{file}' cannot be written: {error.strerror}")
    else:
        shown = f"'slipgrasp serve --hand {arguments.output.name}' shows them"
        print(f"meshes: {file.name}, {meshes.num_triangles} triangles; {shown}")


def _visuals(arguments: argparse.Namespace) -> Visuals:
    """The reader of the visible shapes of the file."""
    from slipgrasp.core.scenario.hand_files.mjcf import read_mjcf_visuals
    from slipgrasp.core.scenario.hand_files.visuals import read_urdf_visuals

    file, text = arguments.file, _text_of(arguments.file)
    if "<mujoco" in text:
        return read_mjcf_visuals(file)
    return read_urdf_visuals(text, file.parent, arguments.packages)


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


def _coupled(text: str) -> tuple[str, Follows]:
    from slipgrasp.core.scenario.hand_files.description import Follows

    name, _, given = text.partition("=")
    leader, *numbers = given.split(",")
    try:
        ratio, offset = map(float, [*numbers, "0"][:2])
        if len(numbers) not in (1, 2):
            raise ValueError
    except ValueError:
        example = "such as joint_3=joint_2,0.8"
        raise CommandError(f"--couple {text}: give {_COUPLING}, {example}") from None
    return name, Follows(leader, ratio, offset)
