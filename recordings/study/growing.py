"""Columns that grow row by row while others read them, in little memory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from slipgrasp.recordings.study.ordering import order_of

_FIRST_ROWS = 256


class GrowingColumn(Protocol):
    """One column of a table that grows.

    A row is appended to all columns before it is counted, and what is written never
    changes, so that whoever reads no more rows than are counted needs no lock.
    """

    def append(self, value: Any) -> None:
        """Adds the value of the next row."""
        ...

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows, as plain values for JSON."""
        ...

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values as numbers, NaN where there is none."""
        ...

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Some rows in the order of their values, those without a value last."""
        ...


@dataclass(slots=True)
class _Array:
    """Numbers or bytes of one width, in an array that is replaced by a larger one when full."""

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
    """Numbers, whole numbers or truth values; None is allowed everywhere.

    Args:
        kind: What the values are given back as.
    """

    def __init__(self, kind: Literal["number", "integer", "boolean"] = "number") -> None:
        self._array = _Array("<f8")
        self._convert: Any = {"number": float, "integer": int, "boolean": bool}[kind]

    def append(self, value: float | None) -> None:
        """Adds the value of the next row."""
        self._array.append(math.nan if value is None else value)

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows."""
        found = self._array.values[np.asarray(rows, dtype=np.intp)].tolist()
        return [None if math.isnan(value) else self._convert(value) for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values, NaN where there is none."""
        return self._array.values[:count]

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Some rows in the order of their values."""
        keys = self._array.values[rows]
        return rows[np.argsort(-keys if descending else keys, kind="stable")]


class HashColumn:
    """Hashes, all of one length, as text of hexadecimal digits.

    Args:
        num_digits: How many digits each has.
    """

    def __init__(self, num_digits: int) -> None:
        self._array = _Array(f"S{num_digits}")

    def append(self, value: str) -> None:
        """Adds the value of the next row."""
        self._array.append(value.encode("ascii"))

    def take(self, rows: Sequence[int]) -> list[str]:
        """The values of some rows."""
        found = self._array.values[np.asarray(rows, dtype=np.intp)].tolist()
        return [value.decode("ascii") for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """No numbers: NaN."""
        return np.full(count, math.nan)

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Some rows in the order of their values."""
        return order_of(self.take(rows.tolist()), rows, descending=descending)


class ValueColumn:
    """Words, lists, or values of several kinds; equal ones are kept once."""

    def __init__(self) -> None:
        self._values: list[Any] = []
        self._known: dict[tuple[type, Any], Any] = {}

    def append(self, value: Any) -> None:
        """Adds the value of the next row."""
        if len(self._known) < _FIRST_ROWS:
            value = self._known.setdefault((type(value), value), value)
        self._values.append(value)

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows, tuples as lists."""
        values = self._values
        found = [values[row] for row in rows]
        return [list(value) if isinstance(value, tuple) else value for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The numbers among the first values, NaN for all else."""
        found = self._values[:count]
        plain = [isinstance(v, (int, float)) and not isinstance(v, bool) for v in found]
        return np.array(
            [v if is_number else math.nan for v, is_number in zip(found, plain, strict=True)]
        )

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Some rows in the order of their values."""
        return order_of(self.take(rows.tolist()), rows, descending=descending)
