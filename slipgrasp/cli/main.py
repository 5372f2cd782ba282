"""The command ``slipgrasp``."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from slipgrasp.cli import (
    diff,
    export,
    figures,
    fit,
    hands,
    import_data,
    laws,
    margin,
    page,
    prune,
    rebuild,
    recover,
    replay,
    run,
    scenarios,
    scene,
    serve,
    study,
    verify,
)
from slipgrasp.cli.status import CommandError, ExitStatus, complain
from slipgrasp.core.exceptions import SlipgraspError

_COMMANDS = (
    *(run, margin, study, rebuild, import_data, fit, replay, diff, verify),
    *(export, page, scene, figures, recover, prune, scenarios, hands, laws, serve),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line.

    Args:
        arguments: Arguments after the program's name; those of this process if None.

    Returns:
        The exit status: 0 completed, 1 different, no margin, or residuals larger than the noise,
        2 bad input, 3 ended early for a physical reason, 4 any other early end.
    """
    _replace_what_the_terminal_cannot_show()
    try:
        parsed, unknown = _make_parser().parse_known_args(arguments)
        if unknown:
            help_of = f"(see 'slipgrasp {parsed.command} --help')"
            raise CommandError(f"unrecognized arguments: {' '.join(unknown)} {help_of}")
        status = parsed.execute(parsed)
        sys.stdout.flush()
    except SlipgraspError as error:
        complain(str(error))
        status = ExitStatus.BAD_INPUT
    except KeyboardInterrupt:
        complain("interrupted; nothing is saved")
        status = ExitStatus.ENDED_EARLY
    except BrokenPipeError:
        # The reader of the output has closed it.
        _drop_output()
        status = ExitStatus.COMPLETED
    except OSError as error:
        _drop_output()
        complain(f"cannot write the output: {error.strerror}")
        status = ExitStatus.ENDED_EARLY
    return int(status)


def _drop_output() -> None:
    """Discards buffered output, which would make the interpreter fail at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports errors on one line."""

    def error(self, message: str) -> NoReturn:
        complain(f"{message} (see '{self.prog} --help')")
        sys.exit(ExitStatus.BAD_INPUT)


class _Version(argparse.Action):
    """``--version``, which imports the version only when used."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, help="show the version")

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Prints the version and ends the program."""
        from slipgrasp.core.run.provenance import program_version

        print(f"slipgrasp {program_version()}")
        parser.exit()


def _make_parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="slipgrasp", description="Simulate robotic grasping with slipping fingertips."
    )
    parser.add_argument("--version", action=_Version)
    commands = parser.add_subparsers(metavar="COMMAND", dest="command", required=True)
    for command in _COMMANDS:
        part = commands.add_parser(
            command.NAME,
            help=command.HELP,
            description=command.DESCRIPTION,
            epilog=getattr(command, "EPILOG", None),
            conflict_handler="resolve",  # some have another --help
        )
        part.set_defaults(execute=command.execute)
        command.add_arguments(part)
    return parser


def _replace_what_the_terminal_cannot_show() -> None:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
