"""Signals of a run by column, as streamed JSON.

Columns have their usual names (`slipgrasp.core.trace.columns`); the name of a signal stands for all
of its columns.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.file.segment import Segment
from slipgrasp.server.exceptions import InvalidRequestError, printable

VALUES_AT_ONCE = 1500
MAX_UNKNOWN_LISTED = 20


class SignalsPublic(BaseModel):
    """Columns of a run, all of the same length."""

    id: str
    count: int = Field(description="number of values of each column")
    units: dict[str, str] = Field(description="SI unit of each column")
    signals: dict[str, list[float | str | None]] = Field(
        description="numbers, null if missing; phases as words",
        examples=[{"t": [0.0, 0.005], "phase_0": ["slip_forward", "stick"]}],
    )


class SignalsQuery(BaseModel):
    """The requested columns and time range."""

    names: Annotated[
        str,
        Field(
            max_length=4000,
            description="columns as in the CSV file, or whole signals, separated by commas; "
            "all if omitted",
            examples=["t,slip,normal_force_0"],
        ),
    ] = ""
    t_from: Annotated[
        float, Field(ge=0.0, allow_inf_nan=False, description="time of the first values [s]")
    ] = 0.0
    t_to: Annotated[
        Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None,
        Field(description="time of the last values [s]; the end of the run if omitted"),
    ] = None

    @property
    def wanted(self) -> list[str]:
        """The names as a list."""
        return [name.strip() for name in self.names.split(",")] if self.names else []

    def share_of(self, end_time: float) -> float:
        """The requested fraction of the time of a run, 0 to 1."""
        if end_time <= 0.0:
            return 1.0
        end = end_time if self.t_to is None else min(self.t_to, end_time)
        return max(0.0, end - self.t_from) / end_time

    def segment_of(self, columns: Iterable[Column]) -> Segment:
        """The signals and times of a recording for these columns."""
        end = math.inf if self.t_to is None else self.t_to
        signals = frozenset(column.signal for column in columns)
        return Segment(signals=signals, start=self.t_from, end=end)


def select_columns(trace: Trace, names: Iterable[str]) -> list[Column]:
    """The requested columns in order, without repetition; all if none is named.

    Args:
        trace: The trace.
        names: Names of columns or of signals.

    Raises:
        InvalidRequestError: For an unknown name, with the most similar one.
    """
    columns = columns_of(trace)
    wanted = list(names)
    if not wanted:
        return columns
    known = {c.name for c in columns} | {c.signal for c in columns}
    if unknown := [name for name in wanted if name not in known][:MAX_UNKNOWN_LISTED]:
        raise InvalidRequestError([_unknown_name(name, known) for name in unknown])
    chosen = {c.name: c for name in wanted for c in columns if name in (c.name, c.signal)}
    return list(chosen.values())


def _unknown_name(name: str, known: Iterable[str]) -> FieldError:
    shown = printable(name)
    message = f"unknown signal '{shown}'{nearest(name, sorted(known))}"
    return FieldError(field="names", value=shown, limit=None, message=message)


def encode_columns(run_id: str, columns: Iterable[Column]) -> Iterator[str]:
    """JSON text in pieces: id, units and the values of each column.

    Args:
        run_id: Id of the run.
        columns: Columns to encode.
    """
    listed = list(columns)
    units = {column.name: column.unit for column in listed}
    count = len(listed[0].values) if listed else 0
    yield f'{{"id":{json.dumps(run_id)},"count":{count},"units":{json.dumps(units)},"signals":{{'
    for i, column in enumerate(listed):
        yield f"{',' if i else ''}{json.dumps(column.name)}:["
        for start in range(0, count, VALUES_AT_ONCE):
            piece = replace(column, values=column.values[start : start + VALUES_AT_ONCE])
            text = json.dumps(_plain(piece), allow_nan=False, separators=(",", ":"))
            yield f"{',' if start else ''}{text[1:-1]}"
        yield "]"
    yield "}}"


def _plain(column: Column) -> list[float | None] | list[str]:
    """Converts phases to words, and values that are not finite to null."""
    if column.holds_phases:
        return column.phase_labels()
    finite = np.isfinite(column.values)
    if finite.all():
        return column.values.tolist()
    pairs = zip(column.values.tolist(), finite, strict=True)
    return [value if ok else None for value, ok in pairs]
