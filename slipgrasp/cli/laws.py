"""``slipgrasp laws``: list the control laws, or write a new one."""

from __future__ import annotations

import argparse
import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipgrasp.cli.status import CommandError, ExitStatus

NAME = "laws"
HELP = "list the control laws, or write a new one"
DESCRIPTION = (
    "List the control laws: the built-in ones, and those of installed packages (entry points of "
    "the group slipgrasp.laws)."
)
_FILE = re.compile(r"[A-Za-z_]\w*\.py")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parts = parser.add_subparsers(metavar="COMMAND")
    new = parts.add_parser(
        "new",
        help="write an example law and its test",
        description="Write a working example of a custom law, and its test in the same folder.",
    )
    new.add_argument("file", metavar="FILE.py", type=Path, help="file to write")
    new.set_defaults(execute=_write)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Lists the laws."""
    laws = [*_built_in(), *_installed()]
    if arguments.json:
        print(json.dumps({"laws": laws}, allow_nan=False))
        return ExitStatus.COMPLETED
    for law in laws:
        version = f" {law['version']}" if law["version"] else ""
        alias = f"{law['alias']}, " if law["alias"] else ""
        print(f"{alias}{law['name']}{version}\t{law['summary']}")
    return ExitStatus.COMPLETED


def _built_in() -> list[dict[str, Any]]:
    from slipgrasp.core.scenario.laws import CONTROL_LAWS, LAW_ALIASES

    aliases = {kind: alias for alias, kind in LAW_ALIASES.items()}
    return [
        _document(law.kind, law.summary, alias=aliases.get(law.kind, ""))
        for law in CONTROL_LAWS.values()
    ]


def _installed() -> list[dict[str, Any]]:
    from slipgrasp.core.scenario.law_loading import LawError, installed_law_names, load_law

    found = []
    for name in installed_law_names():
        try:
            law = load_law(name)
        except LawError as error:
            found.append(_document(name, f"cannot be used: {error}"))
            continue
        parameters = {key: asdict(each) for key, each in law.parameters.items()}
        identity = law.identity
        document = _document(name, law.summary, identity.version, identity.digest, parameters)
        found.append(document)
    return found


def _document(
    name: str,
    summary: str,
    version: str = "",
    digest: str = "",
    parameters: dict[str, Any] | None = None,
    alias: str = "",
) -> dict[str, Any]:
    return {
        "name": name,
        "alias": alias,
        "version": version,
        "digest": digest,
        "summary": summary,
        "parameters": parameters or {},
    }


def _write(arguments: argparse.Namespace) -> ExitStatus:
    from slipgrasp.cli.law_template import LAW, TEST

    law: Path = arguments.file
    if not _FILE.fullmatch(law.name):
        raise CommandError(f"'{law.name}' is not the name of a Python module, such as my_law.py")
    words = [word for word in law.stem.lower().split("_") if word] or ["law"]
    test = law.with_name(f"test_{law.name}")
    names = {
        "name": "".join(word.capitalize() for word in words),
        "kind": "-".join(words),
        "file": law.name,
        "test": test.name,
    }
    for path in (law, test):
        if path.exists():
            raise CommandError(f"'{path}' exists; choose another name")
    try:
        law.write_text(LAW.substitute(names), encoding="utf-8")
        test.write_text(TEST.substitute(names), encoding="utf-8")
    except OSError as error:
        raise CommandError(f"'{law}' cannot be written: {error.strerror}") from error
    print(f"Wrote {law}. Run it with: slipgrasp run composite-case-2 --law {law}:{names['name']}")
    print(f"Wrote {test}. Run it with: python -m pytest {test} (needs pytest)")
    return ExitStatus.COMPLETED
