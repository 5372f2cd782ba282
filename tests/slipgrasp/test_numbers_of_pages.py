"""README and docs: every number that was measured or chosen says where it comes from.

``<!-- from: A; B -->`` names the sources of all numbers up to the next heading or the next such
mark: commands that print or draw what they follow from, and files that choose or assert them. A
number is one with a unit, a point, an exponent, or thousands. What stands in code, in formulas
and in tables that a benchmark writes needs no mark, nor do versions.
"""

import re
import shlex
from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks.__main__ import PARTS
from slipgrasp.cli.main import _make_parser

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NUMBER = re.compile(
    r"(?<![\w.])(?:\d[\d.,]*(?:[–-]\d[\d.]*)?[  ]?"
    r"(?:%|×|°|times\b|(?:[nµmck]?m|[nµm]?s|min|h|days|k?N|k?g|[mµ]?J|[mµ]?rad|[kM]?Hz|[kMG]i?B)\b)"
    r"|\d+\.\d+|\d+e-?\d+|\d{1,3}[  ]\d{3}\b)"
)
NO_NUMBER = re.compile(
    r"^```.*?^```$|<!-- ([\w-]+) -->.*?<!-- end \1 -->|^Data: [^\n]*$"  # benchmarks
    r"|`[^`]*`|\$[^$]*\$|\]\([^)]*\)|<(?!!--)[^>]*>"  # code, formulas, links, HTML
    r"|(?:Python|MuJoCo|sections?|and) (?:≥ |from )?\d+\.\d+",  # versions, sections of a book
    re.MULTILINE | re.DOTALL,
)
MARK = re.compile(r"<!-- from: (.*?) -->", re.DOTALL)
PLACE = re.compile(r"^#+ [^\n]*|<!-- from: .*?-->", re.MULTILINE | re.DOTALL)


def unmarked(text):
    """Numbers of a page behind a heading without a mark."""
    blanked = NO_NUMBER.sub(lambda match: "\n" * match[0].count("\n"), text)
    ends = [0, *(match.end() for match in PLACE.finditer(blanked)), len(blanked)]
    places = ["", *PLACE.findall(blanked)]
    for place, start, end in zip(places, ends, ends[1:], strict=False):
        if not place.startswith("<!--"):
            yield from (match[0] for match in NUMBER.finditer(PLACE.sub("", blanked[start:end])))


def exists(source):
    """Whether a source is a command of this program or a file of this repository."""
    program, *arguments = shlex.split(source)
    if program == "slipgrasp":
        _make_parser().parse_args(arguments)
        return True
    if program == "make":
        return bool(re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE))
    if (program, *arguments[:2]) == ("python", "-m", "benchmarks"):
        parts = [a for a in arguments[2:] if not a.startswith("-") and not a.isdigit()]
        return bool(parts) and set(parts) <= set(PARTS)
    if program == "python":
        return arguments[0] == "-m" and find_spec(arguments[1]) is not None
    return not arguments and (ROOT / program).is_file()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_number_says_where_it_comes_from(page):
    text = page.read_text(encoding="utf-8")
    assert list(unmarked(text)) == []
    sources = [one for mark in MARK.findall(text) for one in " ".join(mark.split()).split("; ")]
    assert [source for source in sources if not exists(source)] == []


def test_a_number_without_a_mark_is_found():
    marked = "<!-- from: slipgrasp run paper-case-1 -->\nIt slips 2.6 mm.\n"
    assert list(unmarked(marked)) == []
    assert list(unmarked(f"{marked}\n## Next\nIt slips 2.6 mm in 0.1 s.")) == ["2.6 mm", "0.1 s"]
    numbers = "1 000 objects, 35 % of them; 1e-9, 3 ×; Eq. 20, 12 fingers, Python 3.11, `0.5`"
    assert list(unmarked(numbers)) == ["1 000", "35 %", "1e-9", "3 ×"]


@pytest.mark.parametrize("source", ["core/absent.py", "make absent", "python -m benchmarks absent"])
def test_a_source_that_is_not_there_is_found(source):
    assert not exists(source)
