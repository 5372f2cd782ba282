"""docs/data/paper.csv: everything in the paper is there once, with functions that exist."""

import ast
import csv
import re
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
with (ROOT / "docs" / "data" / "paper.csv").open(encoding="utf-8", newline="") as FILE:
    ROWS = list(csv.reader(FILE))[1:]
NAMED = sorted(
    {name for row in ROWS for name in re.findall(r"`([\w/]+\.py)::(\w+)`", "".join(row))}
)
IN_THE_PAPER = Counter(
    [f"Eq. {number}" for number in range(1, 65)]
    + [f"Eq. A.{number}" for number in range(1, 7)]
    + [f"Table {number}" for number in ("I", "II", "III")]
    + [f"Theorem {number}" for number in range(1, 5)]
    + [f"Fig. {number}" for number in range(1, 11)]
)
# Inside a row of its proof, and singled out once more.
TWICE = Counter(["Eq. 33", "Eq. 46"])


def places(cell):
    """``Eq. 7–10``, ``Fig. 5, 8`` or ``Theorem 2, Eq. 20``, one by one."""
    kind = ""
    for part in cell.split(", "):
        word, _, number = part.rpartition(" ")
        kind = word or kind
        first, _, last = number.partition("–")
        if not last:
            yield f"{kind} {first}"
            continue
        head, start = re.fullmatch(r"(\D*)(\d+)", first).groups()
        end = re.fullmatch(r"\D*(\d+)", last).group(1)
        yield from (f"{kind} {head}{k}" for k in range(int(start), int(end) + 1))


@cache
def functions_in(path):
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_everything_in_the_paper_stands_there_once():
    assert Counter(place for row in ROWS for place in places(row[0])) == IN_THE_PAPER + TWICE


@pytest.mark.parametrize(("path", "name"), NAMED)
def test_what_is_named_is_there(path, name):
    assert name in functions_in(path)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_every_row_has_function_and_test_or_says_why_there_is_nothing_to_do(row):
    _, _, function, test, judged = row
    assert re.search(r"`(core|figures)/", function) or function == "–"
    if test == "–":
        assert function == "–"
        assert re.match("nothing to compute|sketches", judged)
    else:
        assert all("::test_" in one and one.startswith("`tests/") for one in test.split(", "))
