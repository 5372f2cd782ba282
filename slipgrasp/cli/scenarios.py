"""``slipgrasp scenarios``: list presets and parameters, or print or write a scenario."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import write_new
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.scenario.parameters import Parameter

NAME = "scenarios"
HELP = "list presets and parameters, or print or write a scenario"
DESCRIPTION = "List the presets, print a scenario, list its parameters, or write a new one."
_FIRST_PRESET = "composite-case-2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parts = parser.add_subparsers(metavar="COMMAND")
    show = parts.add_parser(
        "show",
        help="print a scenario as TOML",
        description="Print a scenario as a TOML file for 'slipgrasp run'.",
    )
    show.add_argument("scenario", metavar="NAME", help="name of a preset, or a TOML file")
    show.set_defaults(execute=_show)
    _add_new(parts)
    parameters = parts.add_parser(
        "parameters",
        help="list the parameters of a scenario",
        description="List the parameters of a scenario: key, value, allowed values and meaning.",
    )
    parameters.add_argument(
        "scenario",
        metavar="NAME",
        nargs="?",
        help="name of a preset, or a TOML file (default: paper-case-1)",
    )
    parameters.set_defaults(execute=_list_parameters)


def _add_new(parts: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    new = parts.add_parser(
        "new",
        help="write a scenario to start from",
        description="Write a valid scenario as TOML, with a comment for each parameter: "
        "meaning, unit and limits.",
    )
    new.add_argument("file", metavar="FILE.toml", type=Path, help="file to write")
    new.add_argument(
        "--from",
        dest="preset",
        metavar="NAME",
        default=_FIRST_PRESET,
        help="preset to start from (default: %(default)s)",
    )
    new.set_defaults(execute=_write)


def _write(arguments: argparse.Namespace) -> ExitStatus:
    from slipgrasp.cli.scenario_template import commented
    from slipgrasp.core.scenario.field_errors import nearest
    from slipgrasp.core.scenario.loading import (
        all_preset_names,
        load_scenario,
        preset_text,
        settable_parameters,
    )

    file, preset = arguments.file, arguments.preset
    if file.suffix != ".toml":
        raise CommandError(f"'{file}' does not end in .toml")
    if preset not in all_preset_names():
        raise CommandError(f"no preset '{preset}'{nearest(preset, all_preset_names())}")
    parameters = settable_parameters(load_scenario(preset))
    write_new(file, commented(preset_text(preset), parameters, file.name))
    print(f"Wrote {file}. Run it with: slipgrasp run {file}")
    return ExitStatus.COMPLETED


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Lists the presets."""
    from slipgrasp.core.scenario.loading import all_preset_names, load_scenario

    for name in all_preset_names():
        print(f"{name}\t{load_scenario(name).title}")
    return ExitStatus.COMPLETED


def _show(arguments: argparse.Namespace) -> ExitStatus:
    from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml

    print(scenario_to_toml(load_scenario(arguments.scenario)), end="")
    return ExitStatus.COMPLETED


def _list_parameters(arguments: argparse.Namespace) -> ExitStatus:
    from slipgrasp.core.scenario.loading import load_scenario, preset_names, settable_parameters

    scenario = load_scenario(arguments.scenario or preset_names()[0])
    for parameter in settable_parameters(scenario).values():
        print(_line(parameter))
    return ExitStatus.COMPLETED


def _line(parameter: Parameter) -> str:
    value = "none" if parameter.value is None else str(parameter.value)
    return "\t".join([parameter.key, value, parameter.limit, parameter.text])
