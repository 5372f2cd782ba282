"""Columns of a study's results: names and storage of values."""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.metrics import single_metrics
from slipgrasp.core.study.definition import Study, Value
from slipgrasp.recordings.study.map_axes import is_number, parameter_of

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


_MOST_KNOWN = 256
"""Number of distinct values of a column of which equal ones are stored once."""

_NUMBERS: dict[Kind, Callable[[float], Any]] = {"number": float, "integer": int, "boolean": bool}


class ColumnValues:
    """Values of a column to which rows are appended while others read it; each may be None.

    A row is appended to all columns before it is counted, and existing values never change, so that
    reading counted rows needs no lock. Numbers take 8 bytes each.

    Args:
        kind: Type of the values.
    """

    def __init__(self, kind: Kind) -> None:
        self._convert = _NUMBERS.get(kind)
        self._values: Any = [] if self._convert is None else array("d")
        self._known: dict[tuple[type, Any], Any] = {}

    def append(self, value: Any) -> None:
        """Appends the value of the next row."""
        if self._convert is not None:
            value = math.nan if value is None else value
        elif len(self._known) < _MOST_KNOWN:
            value = self._known.setdefault((type(value), value), value)
        self._values.append(value)

    def take(self, rows: Sequence[int]) -> list[Any]:
        """The values of some rows, as plain values for JSON."""
        found = list(map(self._values.__getitem__, rows))
        if self._convert is not None:
            return [None if math.isnan(value) else self._convert(value) for value in found]
        return [list(value) if isinstance(value, tuple) else value for value in found]

    def numbers(self, count: int) -> NDArray[np.float64]:
        """The first values as numbers, NaN for others."""
        found = self._values[:count]
        if self._convert is None:
            found = [value if is_number(value) else math.nan for value in found]
        return np.array(found, dtype=np.float64)

    def order(self, rows: NDArray[np.intp], *, descending: bool) -> NDArray[np.intp]:
        """Sorts rows by their values; equal ones keep their order, those without one come last."""
        keys = self._sort_keys()[rows]
        return rows[np.argsort(-keys if descending else keys, kind="stable")]

    def _sort_keys(self) -> NDArray[np.float64]:
        if self._convert is not None:
            return self.numbers(len(self._values))
        values = [None if value is None else _sort_key(value) for value in self._values]
        known = sorted({*filter(None, values)})
        ranks: dict[Any, float] = {key: rank for rank, key in enumerate(known)}
        return np.array([ranks.get(key, math.nan) for key in values])


def _sort_key(value: Any) -> tuple[int, float, str]:
    """Numbers come first, then text, with lists as JSON."""
    if isinstance(value, (int, float)):
        return (0, float(value), "")
    return (1, 0.0, value if isinstance(value, str) else json.dumps(value))
