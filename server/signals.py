"""The signals of a run by name, column by column, as JSON that is never whole in memory.

A column is named as in the CSV export where that has it; the other signals of
`core.trace.SIGNALS` follow the same pattern. A signal's own name stands for all its columns.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.exceptions import FieldError
from core.loading import parameter_definitions
from core.result import RunResult
from core.trace import OBJECT_COORDINATES, SIGNALS, Signal
from core.types import ContactPhase
from server.errors import InvalidRequestError, nearest, printable

__all__ = ["Column", "columns_of", "encode_columns", "select_columns"]

VALUES_AT_ONCE = 5000
MAX_UNKNOWN_LISTED = 20

_PREFIXES = {
    "times": "t",
    "object_pose": "",
    "tracking_error": "error",
    "joint_torque": "torque",
    "estimates": "estimate",
    "true_parameters": "true_parameter",
}
_PHASES = {phase.value: phase.label for phase in ContactPhase}


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One number or phase over time.

    Attributes:
        name: Its name in the CSV export, or built alike.
        signal: The signal of the trace it belongs to.
        unit: SI unit.
        values: One entry per row of the trace.
    """

    name: str
    signal: str
    unit: str
    values: NDArray[np.float64] | NDArray[np.int8]


def columns_of(result: RunResult) -> list[Column]:
    """All columns of a run, in the order of `core.trace.SIGNALS`."""
    return [column for signal in SIGNALS for column in _columns_of(result, signal)]


def _columns_of(result: RunResult, signal: Signal) -> Iterator[Column]:
    values = getattr(result.trace, signal.name)
    prefix = _PREFIXES.get(signal.name, signal.name)
    labels = _labels(result, signal)
    units = _units(result, signal, len(labels))
    table = values.reshape(len(values), len(labels))
    for label, unit, column in zip(labels, units, table.T, strict=True):
        name = "_".join(part for part in (prefix, label) if part)
        yield Column(name, signal.name, unit, column)


def _labels(result: RunResult, signal: Signal) -> tuple[str, ...]:
    shape = result.trace.shape
    contacts = range(shape.num_contacts)
    if signal.per == "coordinate":
        return OBJECT_COORDINATES
    if signal.per == "contact":
        return tuple(str(contact) for contact in contacts)
    if signal.per == "joint":
        joints = range(shape.width(signal) // shape.num_contacts)
        return tuple(f"{finger}_{joint}" for finger in contacts for joint in joints)
    return shape.unknowns if signal.per == "unknown" else ("",)


def _units(result: RunResult, signal: Signal, count: int) -> list[str]:
    if signal.per == "unknown":
        definitions = parameter_definitions(result.scenario)
        return [definitions[key].unit for key in result.trace.shape.unknowns]
    units = signal.unit.split(", ")
    # One unit for all, one each, or one for x and y and one for the angle.
    return [*units[:1] * (count - len(units)), *units]


def select_columns(result: RunResult, names: Iterable[str]) -> list[Column]:
    """The columns that are asked for, in that order, each once; all if none is named.

    Args:
        result: The run.
        names: Names of columns or of signals.

    Raises:
        InvalidRequestError: For a name there is none of, with the nearest.
    """
    columns = columns_of(result)
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
    """JSON text in small pieces: id, units and the values of each column.

    Args:
        run_id: Id of the run.
        columns: What to encode.
    """
    listed = list(columns)
    units = {column.name: column.unit for column in listed}
    count = len(listed[0].values) if listed else 0
    yield f'{{"id":{json.dumps(run_id)},"count":{count},"units":{json.dumps(units)},"signals":{{'
    for i, column in enumerate(listed):
        yield f"{',' if i else ''}{json.dumps(column.name)}:["
        for start in range(0, count, VALUES_AT_ONCE):
            values = _plain(column.values[start : start + VALUES_AT_ONCE])
            text = json.dumps(values, allow_nan=False, separators=(",", ":"))
            yield f"{',' if start else ''}{text[1:-1]}"
        yield "]"
    yield "}}"


def _plain(values: NDArray[np.float64] | NDArray[np.int8]) -> list[float | None] | list[str]:
    """Phases as words, what is not finite as null."""
    if np.issubdtype(values.dtype, np.integer):
        return [_PHASES[value] for value in values.tolist()]
    finite = np.isfinite(values)
    if finite.all():
        return values.tolist()
    return [value if ok else None for value, ok in zip(values.tolist(), finite, strict=True)]
