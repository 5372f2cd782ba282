"""Results of a study as a table with one row per run, which grows while it is read."""

from __future__ import annotations

from copy import copy
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.study.definition import Study
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.result_columns import ColumnValues, ResultColumn, columns_of
from slipgrasp.recordings.study.study_row import StudyRow


class ResultTable:
    """One row per run, in the order of their indices.

    One thread may append rows while others read. A single method sees the rows that were complete
    when it was called; several calls need the same `first` rows.

    Args:
        study: The study.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.columns = columns_of(study)
        self._stores = {column.name: ColumnValues(column.kind) for column in self.columns}
        self._count = 0
        self._lock = Lock()

    @property
    def num_rows(self) -> int:
        """Number of finished runs."""
        return self._count

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(self._stores)

    def append(self, row: StudyRow) -> None:
        """Appends the row of the next run.

        Raises:
            ValueError: If it is not the next row.
        """
        cells = self._cells(row)
        with self._lock:
            if row.index != self._count:
                raise ValueError(f"row {row.index} cannot follow {self._count} rows")
            for name, store in self._stores.items():
                store.append(cells.get(name))
            self._count += 1

    def _cells(self, row: StudyRow) -> dict[str, Any]:
        reason = row.reason
        return {
            **row.values,
            **row.metrics,
            "index": row.index,
            "sample": row.index // self.study.num_combinations,
            "outcome": row.outcome.value,
            "reason": None if reason is None else reason.code,
            "reason_message": None if reason is None else reason.message,
            "end_time": row.end_time,
            "state_hash": row.state_hash,
            "kernel": row.kernel,
            "recording": row.recording,
        }

    def rows(
        self,
        offset: int = 0,
        limit: int | None = None,
        *,
        sort: str = "index",
        outcome: str | None = None,
        held: bool | None = None,
    ) -> tuple[list[dict[str, Any]], int]:
        """Some of the rows, as plain values for JSON.

        Args:
            offset: Number of rows to skip.
            limit: Largest number of results; all if None.
            sort: Name of a column, with a leading minus for descending order. Rows without a value
                come last, equal ones in the order of their runs.
            outcome: Only runs with this outcome.
            held: Only runs that held the object (True), or that did not (False).

        Returns:
            The rows, and their number without offset and limit.

        Raises:
            QueryError: If the column or outcome does not exist.
        """
        column = self.column(sort.removeprefix("-"))
        ordered = chosen = self.first(self.num_rows)._matching(outcome, held)
        if sort != "index":
            store = self._stores[column.name]
            ordered = store.order(chosen, descending=sort.startswith("-"))
        end = None if limit is None else offset + limit
        return self._rows_at(ordered[offset:end].tolist()), len(chosen)

    def first(self, num_rows: int) -> Self:
        """The first rows, which do not change when others are appended; for a single reader.

        Args:
            num_rows: Number of rows, at most the available ones.
        """
        shown = copy(self)
        shown._count = min(num_rows, self._count)
        return shown

    def row(self, index: int) -> dict[str, Any]:
        """The row of a run, as plain values for JSON.

        Raises:
            IndexError: If it has not finished, or does not belong to the study.
        """
        if not 0 <= index < self.num_rows:
            raise IndexError(f"there is no result of run {index}")
        return self._rows_at([index])[0]

    def _rows_at(self, places: list[int]) -> list[dict[str, Any]]:
        columns = [store.take(places) for store in self._stores.values()]
        names = self.column_names
        return [dict(zip(names, cells, strict=True)) for cells in zip(*columns, strict=True)]

    def _matching(self, outcome: str | None, held: bool | None) -> NDArray[np.intp]:
        chosen = np.arange(self.num_rows)
        if outcome is not None:
            known = tuple(Outcome)
            if outcome not in known:
                raise QueryError(outcome, f"'{outcome[:80]}' is not an outcome", known)
            chosen = np.flatnonzero([word == outcome for word in self.values("outcome")])
        if held is not None:
            same = (self.numbers("held") == 1.0) == held
            chosen = chosen[(same & ~self.too_short())[chosen]]
        return chosen

    def too_short(self) -> NDArray[np.bool_]:
        """Mask of the runs that are completed, but too short to decide if they held."""
        words = self.values("outcome")
        completed = np.array([word == Outcome.COMPLETED.value for word in words], dtype=bool)
        return completed & np.isnan(self.numbers("held"))

    def column(self, name: str) -> ResultColumn:
        """Returns the description of a column.

        Raises:
            QueryError: If it does not exist.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise QueryError(name, f"'{name[:80]}' is not a column of the results", self.column_names)

    def numbers(self, name: str) -> NDArray[np.float64]:
        """A column as numbers, NaN for others, shape ``(rows,)``."""
        return self._stores[self.column(name).name].numbers(self.num_rows)

    def values(self, name: str, start: int = 0, end: int | None = None) -> list[Any]:
        """A range of rows of a column, as plain values for JSON."""
        last = self.num_rows if end is None else end
        return self._stores[self.column(name).name].take(range(start, last))
