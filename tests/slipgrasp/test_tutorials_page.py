"""The tutorials: every command is run as it is printed, and prints what the page says."""

import re
import shlex
from pathlib import Path

import pytest

from slipgrasp.cli.main import main

pytestmark = pytest.mark.slow

PAGE = (Path(__file__).parents[2] / "docs" / "tutorials.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(console|toml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"`([a-z]+\.toml)`:")
REST = "…"


def lessons():
    """Commands with the lines that they print, and files to be written, in their order."""
    names = iter(FILE.findall(PAGE))
    for kind, text in BLOCK.findall(PAGE):
        if kind == "toml":
            yield next(names), text
            continue
        for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
            command, _, printed = part.partition("\n")
            yield command, printed


def pattern(printed):
    """A line of ``…`` stands for any lines, ``…`` in a line for anything in it."""
    found = ""
    for line in printed.splitlines():
        found += (
            r"(?:.*\n)*?" if line == REST else ".*".join(map(re.escape, line.split(REST))) + r"\n"
        )
    return re.compile(found)


def test_what_is_printed_is_what_the_page_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SLIPGRASP_DATA", str(tmp_path / "data"))
    for command, printed in lessons():
        if command.endswith(".toml"):
            Path(command).write_text(printed, encoding="utf-8")
            continue
        program, *arguments = shlex.split(command)
        assert program == "slipgrasp"
        main(arguments)
        assert pattern(printed).fullmatch(capsys.readouterr().out), command


def test_a_pattern_refuses_other_lines():
    asked = pattern("a\n…\nb …\n")
    assert asked.fullmatch("a\nx\ny\nb 3\n")
    assert not asked.fullmatch("a\nx\ny\nc 3\n")
    assert not asked.fullmatch("b 3\n")
