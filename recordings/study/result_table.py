"""The results of a study as a table: one row per run, in columns, growing while it is read."""

from __future__ import annotations

from copy import copy
from threading import Lock
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.study.definition import Study
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.result_columns import ResultColumn, column_for, columns_of
from slipgrasp.recordings.study.study_row import StudyRow


class ResultTable:
    """One row per run, in the order of their indices.

    One thread may append rows while others read: each reading sees the rows that were
    complete when it began.

    Args:
        study: The study.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.columns = columns_of(study)
        self._stores = {column.name: column_for(column) for column in self.columns}
        self._count = 0
        self._lock = Lock()

    @property
    def num_rows(self) -> int:
        """How many runs have ended."""
        return self._count

    @property
    def column_names(self) -> tuple[str, ...]:
        """What the columns are called, in order."""
        return tuple(self._stores)

    def append(self, row: StudyRow) -> None:
        """Adds the row of the next run.

        Raises:
            ValueError: If it is not the row that comes next.
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
            offset: How many to leave out.
            limit: How many to give at most; all if None.
            sort: Name of a column, with a minus in front for the largest first. Rows
                without a value come last, equal ones in the order of their runs.
            outcome: Only runs that ended so.
            held: Only runs that held the object, or only those that did not.

        Returns:
            The rows, and how many there are without offset and limit.

        Raises:
            QueryError: If there is no such column, or no such outcome.
        """
        column = self.column(sort.removeprefix("-"))
        chosen = self._matching(outcome, held)
        ordered = chosen
        if column.name != "index" or sort.startswith("-"):
            store = self._stores[column.name]
            ordered = store.order(chosen, descending=sort.startswith("-"))
        end = None if limit is None else offset + limit
        return self._rows_at(ordered[offset:end].tolist()), len(chosen)

    def first(self, num_rows: int) -> Self:
        """The first rows, which stay as they are while others come; to be read alone.

        Args:
            num_rows: How many, at most those that there are.
        """
        shown = copy(self)
        shown._count = min(num_rows, self._count)
        return shown

    def row(self, index: int) -> dict[str, Any]:
        """The row of a run, as plain values for JSON.

        Raises:
            IndexError: If it has not ended, or is none of the study.
        """
        if not 0 <= index < self.num_rows:
            raise IndexError(f"there is no result of run {index}")
        return self._rows_at([index])[0]

    def _rows_at(self, places: list[int]) -> list[dict[str, Any]]:
        columns = [store.take(places) for store in self._stores.values()]
        names = self.column_names
        return [dict(zip(names, cells, strict=True)) for cells in zip(*columns, strict=True)]

    def _matching(self, outcome: str | None, held: bool | None) -> NDArray[np.intp]:
        count = self.num_rows
        chosen = np.arange(count)
        if outcome is not None:
            known = tuple(Outcome)
            if outcome not in known:
                raise QueryError(outcome, f"'{outcome[:80]}' is no outcome", known)
            words = self._stores["outcome"].take(range(count))
            chosen = np.array([i for i in range(count) if words[i] == outcome], dtype=np.intp)
        if held is not None:
            same = (self.numbers("held", count) == 1.0) == held
            chosen = chosen[(same & ~self.too_short(count))[chosen]]
        return chosen

    def too_short(self, count: int) -> NDArray[np.bool_]:
        """Which of the first ``count`` runs are completed, but too short to tell what held."""
        completed = np.array(self.values("outcome", 0, count)) == Outcome.COMPLETED
        return completed & np.isnan(self.numbers("held", count))

    def column(self, name: str) -> ResultColumn:
        """What a column holds.

        Raises:
            QueryError: If there is none of that name.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise QueryError(name, f"'{name[:80]}' is no column of the results", self.column_names)

    def numbers(self, name: str, count: int | None = None) -> NDArray[np.float64]:
        """A column as numbers, NaN where there is none, shape ``(rows,)``; not to be changed.

        Args:
            name: The column.
            count: How many rows; all that there are if None.
        """
        rows = self.num_rows if count is None else count
        return self._stores[self.column(name).name].numbers(rows)

    def values(self, name: str, start: int = 0, end: int | None = None) -> list[Any]:
        """A column from one row to below another, as plain values for JSON."""
        last = self.num_rows if end is None else end
        return self._stores[self.column(name).name].take(range(start, last))
