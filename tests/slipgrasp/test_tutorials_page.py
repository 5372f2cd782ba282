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
from tests.slipgrasp.test_serving_a_network import free_port

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```(console|python|text|toml|yaml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"`([a-z]+\.(?:toml|yaml))`[^`]*?:\n")
PORTS = ("8020", "8786")
REST = "…"


class Step(NamedTuple):
    """A command, a piece of Python or a file, and what the page says it prints."""

    kind: str
    text: str
    printed: str


def steps(page: str) -> Iterator[Step]:
    names = iter(FILE.findall(page))
    blocks = BLOCK.findall(page)
    for (kind, text), (next_kind, next_text) in zip(blocks, [*blocks[1:], ("", "")], strict=True):
        if kind == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, printed = part.partition("\n")
                yield Step(kind, command, printed)
        elif kind == "python":
            yield Step(kind, text, next_text if next_kind == "text" else "")
        elif kind != "text":
            yield Step(next(names), text, "")


def pattern(printed):
    """A line of ``…`` stands for any lines, ``…`` in a line for anything in it."""
    found = ""
    for line in printed.splitlines():
        found += (
            r"(?:.*\n)*?" if line == REST else ".*".join(map(re.escape, line.split(REST))) + r"\n"
        )
    return re.compile(found)


class Reader:
    """Does what a reader of the page does, in one folder, with programs that go on beside it."""

    def __init__(self) -> None:
        self._names: dict[str, Any] = {"__name__": "tutorial"}
        self._beside: list[subprocess.Popen[str]] = []

    def follow(self, step: Step) -> str:
        """What a step prints; of a program that goes on, as many lines as are told."""
        program, *arguments = shlex.split(step.text) if step.kind == "console" else [""]
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            if step.kind == "python":
                exec(compile(step.text, "tutorials.md", "exec"), self._names)
            elif step.kind != "console":
                Path(step.kind).write_text(step.text, encoding="utf-8")
            elif arguments[-1] == "&":
                process = self._begin(program, *arguments[:-1])
                for _ in step.printed.splitlines():
                    print(process.stdout.readline(), end="")
            elif program == "slipgrasp":
                main(arguments)
            else:
                print(subprocess.check_output([program, *arguments], text=True), end="")
        return printed.getvalue()

    def _begin(self, *command: str) -> subprocess.Popen[str]:
        options: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        process = subprocess.Popen(command, text=True, **options)
        self._beside.append(process)
        return process

    def end(self) -> None:
        """Ends the programs beside, those last that others depend on."""
        for process in reversed(self._beside):
            process.terminate()
            process.communicate()


@pytest.fixture
def reader(tmp_path, monkeypatch) -> Iterator[Reader]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    programs = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    for name, value in {
        "PATH": programs,
        "SLIPGRASP_DATA": str(tmp_path / "data"),
        "XDG_CONFIG_HOME": str(tmp_path / "settings"),
        "XDG_DATA_HOME": str(tmp_path / "of_programs"),
        "NO_PROXY": "localhost,127.0.0.1",
        "no_proxy": "localhost,127.0.0.1",
    }.items():
        monkeypatch.setenv(name, value)
    found = Reader()
    yield found
    found.end()


@pytest.mark.parametrize("name", ["get-started", "tutorials", "answers", "lessons", "page"])
def test_what_is_printed_is_what_the_page_says(reader, name):
    page = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    for port in PORTS:
        page = page.replace(port, str(free_port()))
    for step in steps(page):
        printed = reader.follow(step)
        assert pattern(step.printed).fullmatch(printed), f"{step.text}\n{printed}"


def test_a_pattern_refuses_other_lines():
    asked = pattern("a\n…\nb …\n")
    assert asked.fullmatch("a\nx\ny\nb 3\n")
    assert not asked.fullmatch("a\nx\ny\nc 3\n")
    assert not asked.fullmatch("b 3\n")
