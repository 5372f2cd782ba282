"""Columns of a study's results: names and storage of values."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.metrics import single_metrics
from slipgrasp.core.study.definition import Study, Value
from slipgrasp.recordings.file.state_hash import HASH_BYTES
from slipgrasp.recordings.study.map_axes import parameter_of

Kind = Literal["number", "integer", "boolean", "word", "value", "hash"]


@dataclass(frozen=True, slots=True)
class ResultColumn:
    """One column of the results.

    Attributes:
        name: Name: a metric, a varied key, ``outcome`` …
        kind: Type of its values.
        unit: SI unit, "1" for pure numbers, "" if there is none.
        role: Meaning: index of the run, varied value, outcome, metric, or provenance.
    """

    name: str
    kind: Kind
    unit: str
    role: Literal["run", "varied", "ending", "metric", "origin"]


def columns_of(study: Study) -> tuple[ResultColumn, ...]:
    """The columns of a study's results, in order."""
    return (
        ResultColumn("index", "integer", "1", "run"),
        ResultColumn("sample", "integer", "1", "run"),
        *(_varied(study, key) for key in study.keys),
        ResultColumn("outcome", "word", "", "ending"),
        ResultColumn("reason", "word", "", "ending"),
        ResultColumn("reason_message", "word", "", "ending"),
        ResultColumn("end_time", "number", "s", "ending"),
        *(
            ResultColumn(metric.name, metric.kind, metric.unit, "metric")
            for metric in single_metrics(
                len(study.base.fingers), study.base.space, soft=_has_soft_runs(study)
            )
        ),
        ResultColumn("state_hash", "hash", "", "origin"),
        ResultColumn("kernel", "word", "", "origin"),
        ResultColumn("recording", "word", "", "origin"),
    )


def _has_soft_runs(study: Study) -> bool:
    """Whether fingertips may be soft in any run."""
    return study.base.has_soft_fingers or any(key.endswith(".pad_radius") for key in study.keys)


def column_for(column: ResultColumn) -> AppendOnlyColumn:
    """Returns an empty column of the kind."""
    if column.kind == "hash":
        return HashColumn(2 * HASH_BYTES)
    if column.kind in ("word", "value"):
        return ValueColumn()
    return NumberColumn(column.kind)


def _varied(study: Study, key: str) -> ResultColumn:
    parameter = parameter_of(study, key)
    unit = "" if parameter is None else parameter.unit
    return ResultColumn(key, _kind_of(study, key), unit, "varied")


def _kind_of(study: Study, key: str) -> Kind:
    """Converts values to an array of numbers if all have the same kind."""
    for axis in study.axes:
        if axis.key == key and axis.is_range:
            return "integer" if axis.integer else "number"
    kinds = {type(value) for value in _chosen_values(study, key)}
    if kinds == {float}:
        return "number"
    return "integer" if kinds == {int} else "value"


def _chosen_values(study: Study, key: str) -> list[Value]:
    chosen = [axis.values for axis in study.axes if axis.key == key]
    return list(chosen[0] or ()) if chosen else [run.get(key) for run in study.listed]


_FIRST_ROWS = 256


class AppendOnlyColumn(Protocol):
    """A column to which rows are appended while others read it, with little memory.

    A row is appended to all columns before it is counted, and existing values never change, so that
    reading counted rows needs no lock.
    """

    def append(self, value: Any) -> None:
        """Appends the value of the next row."""
        ...

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows, as plain values for JSON."""
        ...

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values as numbers, NaN for others."""
        ...

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Sorts rows by their values; those without a value come last."""
        ...


@dataclass(slots=True)
class _Array:
    """Numbers or bytes of one width, in an array that is reallocated when full."""

    dtype: str
    values: NDArray[Any] = field(init=False)
    count: int = 0

    def __post_init__(self) -> None:
        self.values = np.zeros(_FIRST_ROWS, self.dtype)

    def append(self, value: float | bytes) -> None:
        if self.count == len(self.values):
            larger = np.zeros(2 * self.count, self.dtype)
            larger[: self.count] = self.values
            self.values = larger
        self.values[self.count] = value
        self.count += 1


class NumberColumn:
    """Numbers, integers or Booleans; each may be None.

    Args:
        kind: Type of the returned values.
    """

    def __init__(self, kind: Literal["number", "integer", "boolean"] = "number") -> None:
        self._array = _Array("<f8")
        self._convert: Any = {"number": float, "integer": int, "boolean": bool}[kind]

    def append(self, value: float | None) -> None:
        """Appends the value of the next row."""
        self._array.append(math.nan if value is None else value)

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows."""
        found = self._array.values[np.asarray(rows, dtype=np.intp)].tolist()
        return [None if math.isnan(value) else self._convert(value) for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values, NaN where there is none."""
        return self._array.values[:count]

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Sorts rows by their values."""
        keys = self._array.values[rows]
        return rows[np.argsort(-keys if descending else keys, kind="stable")]


class HashColumn:
    """Hashes of one length, as hexadecimal text.

    Args:
        num_digits: Number of digits.
    """

    def __init__(self, num_digits: int) -> None:
        self._array = _Array(f"S{num_digits}")

    def append(self, value: str) -> None:
        """Appends the value of the next row."""
        self._array.append(value.encode("ascii"))

    def take(self, rows: Sequence[int]) -> list[str]:
        """The values of some rows."""
        found = self._array.values[np.asarray(rows, dtype=np.intp)].tolist()
        return [value.decode("ascii") for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """NaN for each row, because hashes are not numbers."""
        return np.full(count, math.nan)

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Sorts rows by their values."""
        return order_of(self.take(rows.tolist()), rows, descending=descending)


class ValueColumn:
    """Words, lists, or values of several types; equal ones are stored once."""

    def __init__(self) -> None:
        self._values: list[Any] = []
        self._known: dict[tuple[type, Any], Any] = {}

    def append(self, value: Any) -> None:
        """Appends the value of the next row."""
        if len(self._known) < _FIRST_ROWS:
            value = self._known.setdefault((type(value), value), value)
        self._values.append(value)

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows, with tuples as lists."""
        values = self._values
        found = [values[row] for row in rows]
        return [list(value) if isinstance(value, tuple) else value for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values as numbers, NaN for others."""
        found = self._values[:count]
        plain = [isinstance(v, (int, float)) and not isinstance(v, bool) for v in found]
        return np.array(
            [v if is_number else math.nan for v, is_number in zip(found, plain, strict=True)]
        )

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Sorts rows by their values."""
        return order_of(self.take(rows.tolist()), rows, descending=descending)


def order_of(
    values: Sequence[Any], rows: NDArray[np.intp], *, descending: bool
) -> NDArray[np.intp]:
    """Sorts rows by their values; equal ones keep their order, and None comes last.

    Args:
        values: One per row.
        rows: Rows to sort.
        descending: Whether the largest comes first.
    """
    ranks = {key: rank for rank, key in enumerate(sorted(set(map(_key, values))))}
    places = np.array([ranks[_key(value)] for value in values], dtype=np.int64)
    if descending:
        nothing = np.array([value is None for value in values], dtype=bool)
        places = np.where(nothing, len(ranks), -places)
    return rows[np.argsort(places, kind="stable")]


def _key(value: Any) -> tuple[int, float, str]:
    if value is None:
        return (2, 0.0, "")
    if isinstance(value, (int, float)):
        return (0, float(value), "")
    return (1, 0.0, value if isinstance(value, str) else json.dumps(value))
