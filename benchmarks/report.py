"""Tables of results: printed as text, stored in the documentation between marks or as CSV files."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from scipy.stats import binomtest

BENCHMARKS, PORTABILITY = "benchmarks.md", "portability.md"


class Table(NamedTuple):
    """Results of one part.

    Attributes:
        name: Mark of its position in the documentation.
        heads: Heads of the columns; the first column contains text, the others numbers.
        rows: One string per column.
        notes: Sentences below the table.
        page: Its page of the documentation.
    """

    name: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    page: str = BENCHMARKS


def table_of_columns(
    name: str,
    head: str,
    labels: Iterable[str],
    columns: Mapping[str, Sequence[str]],
    notes: tuple[str, ...] = (),
    page: str = BENCHMARKS,
) -> Table:
    """A table from its columns.

    Args:
        name: Its name.
        head: Head of the first column.
        labels: Cells of the first column.
        columns: Cells of the other columns, by head.
        notes: Sentences below the table.
        page: Its page.
    """
    rows = tuple(zip(labels, *columns.values(), strict=True))
    return Table(name, (head, *columns), rows, notes, page)


def table_of_rows(
    name: str, head: str, rows: Mapping[str, Mapping[str, str]], *notes: str, page: str = BENCHMARKS
) -> Table:
    """A table from its rows.

    Args:
        name: Its name.
        head: Head of the first column.
        rows: Cells by the first cell of their row and by the head of their column.
        *notes: Sentences below the table.
        page: Its page.
    """
    heads = (head, *next(iter(rows.values())))
    return Table(
        name, heads, tuple((label, *row.values()) for label, row in rows.items()), notes, page
    )


def format_text(table: Table) -> str:
    """The table as aligned lines, with its notes below."""
    columns = []
    for place, column in enumerate(zip(table.heads, *table.rows, strict=True)):
        width = max(map(len, column))
        columns.append([cell.rjust(width) if place else cell.ljust(width) for cell in column])
    first, *others = ("  ".join(line) for line in zip(*columns, strict=True))
    return "\n".join([first, "-" * len(first), *others, *(f"  {note}" for note in table.notes)])


def judge(value: float, target: float, aim: float | None = None) -> str:
    """Whether a ratio reaches its target and its further aim, as text."""
    words = f"{value:.1f} times; target {target:g}: {met(value >= target)}"
    return words if aim is None else f"{words}, aim {aim:g}: {met(value >= aim)}"


def met(holds: bool) -> str:
    """Whether a target is met, as text."""
    return "met" if holds else "missed"


def share_interval(part: int, whole: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a fraction estimated from a sample.

    Args:
        part: Number of hits in the sample.
        whole: Size of the sample.
    """
    low, high = binomtest(part, whole).proportion_ci(method="wilson")
    return low, high


def format_share(part: int, whole: int) -> str:
    """A fraction in percent, with its 95 % interval: ``28.5 % (25.8–31.4)``."""
    low, high = share_interval(part, whole)
    return f"{100.0 * part / whole:.1f} % ({100.0 * low:.1f}–{100.0 * high:.1f})"


def update_page(path: Path, tables: Iterable[Table]) -> None:
    """Replaces these tables in a page.

    Args:
        path: Markdown file with ``<!-- NAME -->`` and ``<!-- end NAME -->`` around each table, or
            with a line ``Data: [NAME.csv](data/NAME.csv).``: then the rows are written to that
            file, and the line ends with the notes.
        tables: The new tables.

    Raises:
        ValueError: If the page has no place for a table.
    """
    text = path.read_text(encoding="utf-8")
    for table in tables:
        place = re.search(place_of(table.name), text, re.DOTALL | re.MULTILINE)
        if place is None:
            raise ValueError(f"{path} has no marks for '{table.name}'")
        write = _write_data if place["line"] else _format_markdown
        text = text[: place.start()] + write(table, path) + text[place.end() :]
    path.write_text(text, encoding="utf-8")


def place_of(name: str) -> str:
    """Regular expression of a table in a page: its ``body``, or the ``line`` with its file."""
    name = re.escape(name)
    line = rf"^Data: \[{name}\.csv\]\(data/{name}\.csv\)\.[^\n]*$"
    return rf"<!-- {name} -->(?P<body>.*?)<!-- end {name} -->|(?P<line>{line})"


def data_file(page: Path, name: str) -> Path:
    """The CSV file of a table whose rows are not in its page."""
    return page.parent / "data" / f"{name}.csv"


def read_table(page: Path, name: str) -> list[list[str]]:
    """Heads and rows of a table of a page, or of its data file."""
    text = page.read_text(encoding="utf-8")
    place = re.search(place_of(name), text, re.DOTALL | re.MULTILINE)
    if place is None:
        raise ValueError(f"{page} has no marks for '{name}'")
    if place["line"]:
        with data_file(page, name).open(encoding="utf-8", newline="") as file:
            return list(csv.reader(file))
    lines = [line for line in place["body"].splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    return [cells[0], *cells[2:]]


def _write_data(table: Table, page: Path) -> str:
    """Writes the data file of a table, and returns the line of its page."""
    file = data_file(page, table.name)
    file.parent.mkdir(exist_ok=True)
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows((table.heads, *table.rows))
    return " ".join([f"Data: [{file.name}](data/{file.name}).", *table.notes])


def _format_markdown(table: Table, _page: Path) -> str:
    rule = ("---", *("--:" for _ in table.heads[1:]))
    lines = [f"| {' | '.join(cells)} |" for cells in (table.heads, rule, *table.rows)]
    block = "\n".join(["", *lines, "", *(f"{note}\n" for note in table.notes)])
    return f"<!-- {table.name} -->\n{block}\n<!-- end {table.name} -->"
