"""The table of a desired motion from a CSV file in the folder of the scenario file."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import MAX_TABLE_ROWS
from slipgrasp.core.scenario.beside import ONLY_ON_DISK, file_error, read_beside
from slipgrasp.core.scenario.field_errors import shortened
from slipgrasp.core.scenario.scenario import space_of

Columns = tuple[str, ...]

_FIELD = "trajectory.table"
_COUNTS = {4: "four", 7: "seven"}
_MOST = f"{MAX_TABLE_ROWS} rows"
_SIZE = 200_000, f"a table has at most {_MOST}"


def fill_in_table(mapping: dict[str, Any], folder: Path) -> None:
    """Replaces the file name in ``trajectory.table``, if any, with the rows of the file.

    Args:
        mapping: A scenario as plain values, changed in place.
        folder: Folder of the scenario file; no file outside is read.

    Raises:
        ScenarioError: If the file does not exist or has no valid table.
    """
    name = _table_name(mapping)
    if name is not None:
        text = read_beside(name, folder, _FIELD, "a CSV file", _SIZE)
        mapping["trajectory"]["table"] = _parse(text, shortened(name), _columns(mapping))


def refuse_table_name(mapping: Any) -> None:
    """Raises an error if ``trajectory.table`` is a file name, which is allowed only in files.

    Raises:
        ScenarioError: If it is a file name.
    """
    name = _table_name(mapping)
    if name is not None:
        raise _error(
            name,
            f"rows of {', '.join(_columns(mapping))}",
            f"{ONLY_ON_DISK}; give the rows themselves",
        )


def _table_name(mapping: Any) -> str | None:
    trajectory = mapping.get("trajectory") if isinstance(mapping, dict) else None
    table = trajectory.get("table") if isinstance(trajectory, dict) else None
    return table if isinstance(table, str) else None


def _columns(mapping: dict[str, Any]) -> Columns:
    """Names of the columns of a table of poses."""
    return space_of(mapping).table_columns


def _parse(text: str, name: str, columns: Columns) -> list[list[float]]:
    """Rows of numbers; a first line with column names is skipped."""
    rows: list[list[float]] = []
    reader = csv.reader(io.StringIO(text))
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells) or (not rows and _is_header(cells, columns)):
                continue
            if len(rows) == MAX_TABLE_ROWS:
                raise _error(name, _MOST, f"line {reader.line_num}: more than {_MOST}; use fewer")
            rows.append(_parse_row(cells, name, reader.line_num, columns))
    except csv.Error as error:
        raise _error(name, "a CSV file", f"line {reader.line_num}: {error}") from error
    return rows


def _is_header(cells: list[str], columns: Columns) -> bool:
    """Whether the cells are column names, possibly with units: ``t [s]``."""
    return [cell.lower().split("[")[0].split("(")[0].strip() for cell in cells] == list(columns)


def _parse_row(cells: list[str], name: str, line: int, columns: Columns) -> list[float]:
    if len(cells) != len(columns):
        wanted = f"the {_COUNTS[len(columns)]} {', '.join(columns)} separated by commas"
        raise _error(
            name,
            f"{len(columns)} columns",
            f"line {line}: {len(cells)} columns, not {wanted}",
        )
    return [
        _parse_number(cell, name, f"line {line}, column {k + 1} ({columns[k]})")
        for k, cell in enumerate(cells)
    ]


def _parse_number(cell: str, name: str, place: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _error(
            name, "a finite number", f"{place}: '{shortened(cell)}' is not a finite number"
        )
    return number


def _error(name: str, limit: str, problem: str) -> ScenarioError:
    return file_error(_FIELD, name, limit, problem)
