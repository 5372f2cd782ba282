"""A preset as a new scenario file with a comment for each parameter."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from slipgrasp.core.scenario.parameters import Parameter

_TABLE = re.compile(r"\[(?P<list>\[)?(?P<name>[\w.]+)\]")
_KEY = re.compile(r"(?P<name>\w+) =")
_HEAD = """\
# Run it:             slipgrasp run {file}
# Change it live:     slipgrasp serve, then "Scenario file (TOML)" in the dashboard
# All its parameters: slipgrasp scenarios parameters {file}
#
# SI units. The controller knows every parameter that its law uses, except those in [[estimates]].

title = "My scenario"
"""
_WIDTH = 98


def commented(text: str, parameters: Mapping[str, Parameter], file: str) -> str:
    """Returns the text of a scenario with a comment above the first use of each key.

    Args:
        text: TOML, one key per line.
        parameters: Definition of each parameter of the scenario by dotted key.
        file: Name of the new file.
    """
    return _HEAD.format(file=file) + "\n".join(_lines(text, parameters)) + "\n"


def _lines(text: str, parameters: Mapping[str, Parameter]) -> Iterator[str]:
    table, counts, seen = "", dict[str, int](), set[str]()
    for line in text.splitlines():
        if head := _TABLE.match(line):
            outer, _, name = head["name"].rpartition(".")
            # A list inside an item of a list, such as the joints of the last finger.
            table = f"{outer}.{counts[outer]}.{name}" if outer in counts else head["name"]
            if head["list"]:
                counts[table] = counts.get(table, -1) + 1
                table = f"{table}.{counts[table]}"
        elif key := _KEY.match(line):
            if key["name"] == "title":
                continue
            dotted = f"{table}.{key['name']}"
            kind = re.sub(r"\.\d+\.", ".*.", dotted)
            if kind not in seen:
                yield from _comment(dotted, parameters)
            seen.add(kind)
        yield line


def _comment(key: str, parameters: Mapping[str, Parameter]) -> Iterator[str]:
    """Meaning and limits of a parameter, or of the first number of a list."""
    for name, parameter in parameters.items():
        if name == key or name.startswith(f"{key}."):
            text = f"{parameter.text.rstrip('.')} ({parameter.limit})."
            yield from textwrap.wrap(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")
            return
