"""Getting started, tutorials and answers: every block runs, and prints what the page says."""

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from slipgrasp.cli.main import main
from tests.fenced_blocks import DOCS, blocks_of, output_of

pytestmark = pytest.mark.slow

FILE = re.compile(r"`([a-z]+\.toml)`[^`]*?:\n")
REST = "…"


class Step(NamedTuple):
    """A command, a piece of Python or a file, and what the page says it prints."""

    kind: str
    text: str
    printed: str


def steps(page: str) -> Iterator[Step]:
    names = iter(FILE.findall(page))
    for block in blocks_of(page, "console", "python", "toml"):
        if block.kind == "console":
            for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
                command, _, printed = part.partition("\n")
                yield Step(block.kind, command, printed)
        elif block.kind == "python":
            yield Step(block.kind, block.text, block.printed or "")
        else:
            yield Step(next(names), block.text, "")


def pattern(printed):
    """A line of ``…`` stands for any lines, ``…`` in a line for anything in it."""
    found = ""
    for line in printed.splitlines():
        found += (
            r"(?:.*\n)*?" if line == REST else ".*".join(map(re.escape, line.split(REST))) + r"\n"
        )
    return re.compile(found)


class Reader:
    """Does what a reader of the page does, in one folder."""

    def __init__(self) -> None:
        self._names: dict[str, Any] = {"__name__": "tutorial"}

    def follow(self, step: Step) -> str:
        """Output of a step."""
        program, *arguments = shlex.split(step.text) if step.kind == "console" else [""]
        if step.kind == "python":
            return output_of(step.text, self._names)
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            if step.kind != "console":
                Path(step.kind).write_text(step.text, encoding="utf-8")
            elif program == "slipgrasp":
                main(arguments)
            else:
                print(subprocess.check_output([program, *arguments], text=True), end="")
        return printed.getvalue()


@pytest.fixture
def reader(tmp_path, monkeypatch) -> Reader:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    programs = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    for name, value in {
        "PATH": programs,
        "SLIPGRASP_DATA": str(tmp_path / "data"),
        "XDG_CONFIG_HOME": str(tmp_path / "settings"),
        "XDG_DATA_HOME": str(tmp_path / "of_programs"),
    }.items():
        monkeypatch.setenv(name, value)
    return Reader()


@pytest.mark.parametrize("name", ["get-started", "tutorials", "answers", "lessons", "page"])
def test_what_is_printed_is_what_the_page_says(reader, name):
    page = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    for step in steps(page):
        printed = reader.follow(step)
        assert pattern(step.printed).fullmatch(printed), f"{step.text}\n{printed}"


def test_a_pattern_refuses_other_lines():
    asked = pattern("a\n…\nb …\n")
    assert asked.fullmatch("a\nx\ny\nb 3\n")
    assert not asked.fullmatch("a\nx\ny\nc 3\n")
    assert not asked.fullmatch("b 3\n")
