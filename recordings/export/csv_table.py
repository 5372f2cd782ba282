"""A run as a table of text: one row per sample, nothing lost."""

from __future__ import annotations

from dataclasses import replace
from typing import TextIO

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, short_columns

ROWS_AT_ONCE = 1000


def csv_columns(result: RunResult) -> list[str]:
    """Names of the columns, in order."""
    return [column.name for column in short_columns(result.trace)]


def write_csv(result: RunResult, stream: TextIO) -> None:
    """Writes a run as comma-separated values, SI units, with a header line.

    Every number has as many digits as it takes to read back the same bits. An event
    gives two rows with the same time: before and after.

    Args:
        result: The run.
        stream: Where the text goes.
    """
    table = short_columns(result.trace)
    stream.write(",".join(column.name for column in table) + "\n")
    for start in range(0, len(result.trace), ROWS_AT_ONCE):
        words = [_words(column, start) for column in table]
        stream.writelines(",".join(row) + "\n" for row in zip(*words, strict=True))


def _words(column: Column, start: int) -> list[str]:
    """Some rows of a column: phases as words, numbers with every digit."""
    piece = replace(column, values=column.values[start : start + ROWS_AT_ONCE])
    return piece.phase_labels() if piece.holds_phases else list(map(repr, piece.values.tolist()))
