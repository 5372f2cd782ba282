"""Export of the results of a study: CSV, Parquet and JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from typing import Any, BinaryIO, TextIO

from slipgrasp.recordings.study.result_columns import ResultColumn
from slipgrasp.recordings.study.result_table import ResultTable

ROWS_AT_ONCE = 1000
MOST_ROWS_AT_ONCE = 50 * ROWS_AT_ONCE
"""Number of rows in a group of a Parquet file."""

_ARROW_TYPES = {"number": "float64", "integer": "int64", "boolean": "bool"}
"""Types in a Parquet file by kind of column; all others are text."""


def write_csv(results: ResultTable, stream: TextIO) -> None:
    """Writes the results as comma-separated values, SI units, with a header line.

    Numbers have enough digits to read back the same bits; Booleans are ``true`` and ``false``,
    lists are JSON, and missing values are empty.

    Args:
        results: The results so far.
        stream: Output stream.
    """
    table = csv.writer(stream, lineterminator="\n")
    table.writerow(results.column_names)
    for start, end in _groups(results, ROWS_AT_ONCE):
        words = [map(_word, results.values(name, start, end)) for name in results.column_names]
        table.writerows(zip(*words, strict=True))


def _word(cell: Any) -> str:
    if isinstance(cell, str):
        return cell
    if cell is None:
        return ""
    return repr(cell) if isinstance(cell, float) else json.dumps(cell)


def write_json(results: ResultTable, stream: TextIO) -> None:
    """Writes the results as one JSON object.

    It has ``title``, ``base`` (name of the preset, if any), ``runs`` (number of runs of the study),
    ``columns`` (name to unit) and ``rows``, one object per run.

    Args:
        results: The results so far.
        stream: Output stream.
    """
    study = results.study
    head = {
        "title": study.title,
        "base": study.base_name,
        "runs": study.num_runs,
        "columns": {column.name: column.unit for column in results.columns},
    }
    stream.write(json.dumps(head, ensure_ascii=False)[:-1] + ', "rows": [')
    separator = "\n"
    for start, end in _groups(results, ROWS_AT_ONCE):
        for row in results.rows(start, end - start)[0]:
            stream.write(separator + json.dumps(row, ensure_ascii=False, allow_nan=False))
            separator = ",\n"
    stream.write("\n]}\n")


def write_parquet(results: ResultTable, stream: BinaryIO) -> None:
    """Writes the results as a Parquet file.

    Each column has its SI unit as ``unit`` in the metadata of its field. Varied values of several
    types are JSON text. The metadata of the table contains the study, in JSON, as
    ``slipgrasp.study``.

    Args:
        results: The results so far.
        stream: Output stream.
    """
    import pyarrow
    from pyarrow import parquet

    from slipgrasp.core.study.loading import study_to_mapping

    fields = [
        pyarrow.field(
            column.name,
            pyarrow.type_for_alias(_ARROW_TYPES.get(column.kind, "string")),
            metadata={"unit": column.unit},
        )
        for column in results.columns
    ]
    study = json.dumps(study_to_mapping(results.study), ensure_ascii=False, allow_nan=False)
    schema = pyarrow.schema(fields, metadata={"slipgrasp.study": study})
    with parquet.ParquetWriter(stream, schema) as writer:
        for start, end in _groups(results, MOST_ROWS_AT_ONCE):
            arrays = [
                pyarrow.array(_cells(results, column, start, end), field.type)
                for column, field in zip(results.columns, fields, strict=True)
            ]
            writer.write_batch(pyarrow.record_batch(arrays, schema=schema))


def _cells(results: ResultTable, column: ResultColumn, start: int, end: int) -> list[Any]:
    cells = results.values(column.name, start, end)
    if column.kind != "value":
        return cells
    return [cell if cell is None or isinstance(cell, str) else json.dumps(cell) for cell in cells]


def _groups(results: ResultTable, size: int) -> Iterator[tuple[int, int]]:
    """Starts and ends of groups of rows; rows that are appended meanwhile are excluded."""
    count = results.num_rows
    return ((start, min(count, start + size)) for start in range(0, count, size))
