"""The examples of the page on Python run, and print what the page says."""

import contextlib
import io
import re
from pathlib import Path

import pytest

import slipgrasp

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
BLOCK = re.compile(r"^```(python|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def examples():
    """Code and what it prints; nothing where the page does not say."""
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    found = []
    for i, (kind, text) in enumerate(blocks):
        if kind == "python":
            following = blocks[i + 1] if i + 1 < len(blocks) else ("python", "")
            found.append((text, following[1] if following[0] == "text" else None))
    return found


def test_the_examples_print_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "example"}
    for code, expected in examples():
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(PAGE), "exec"), names)
        assert expected is None or printed.getvalue() == expected, code


def test_every_block_of_output_belongs_to_an_example():
    kinds = [kind for kind, _ in BLOCK.findall(PAGE.read_text(encoding="utf-8"))]

    assert kinds.count("text") == sum(expected is not None for _, expected in examples()) >= 5


@pytest.mark.parametrize(
    "name",
    ["simulate", "with_law", "open_recording", "compare", "verify", "write_parquet", "write_npz"],
)
def test_the_page_tells_of_the_public_functions(name):
    assert name in slipgrasp.__all__
    assert f"{name}(" in PAGE.read_text(encoding="utf-8") or f"`{name}`" in PAGE.read_text()
