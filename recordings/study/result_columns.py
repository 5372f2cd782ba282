"""What the columns of a study's results are called, hold and are measured in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from slipgrasp.core.run.result import metric_names
from slipgrasp.core.study.definition import Study, Value
from slipgrasp.recordings.file.state_hash import HASH_BYTES
from slipgrasp.recordings.study.growing import GrowingColumn, HashColumn, NumberColumn, ValueColumn
from slipgrasp.recordings.study.map_axes import parameter_of

Kind = Literal["number", "integer", "boolean", "word", "value", "hash"]

_BOOLEANS = ("held", "slipping_at_end")
_INTEGERS = ("phase_change_count",)
_METRIC_UNITS = {
    "last_slip_time": "s",
    "slip_path": "m",
    "peak_normal_force": "N",
    "minimum_friction_margin": "N",
    "rms_tracking_error_theta": "rad",
    "final_tracking_error_theta": "rad",
    "rms_tracking_error": "m",
    "final_tracking_error": "m",
    "torque_effort": "N² m² s",
    "phase_change_count": "1",
}


@dataclass(frozen=True, slots=True)
class ResultColumn:
    """One column of the results.

    Attributes:
        name: What it is called: a metric, a varied key, ``outcome`` …
        kind: What its values are.
        unit: SI unit, "1" for pure numbers, "" for what has none.
        role: What it tells: which run, what was varied, how it ended, a metric, or where
            it came from.
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
        *(_metric(name) for name in metric_names(len(study.base.fingers))),
        ResultColumn("state_hash", "hash", "", "origin"),
        ResultColumn("kernel", "word", "", "origin"),
        ResultColumn("recording", "word", "", "origin"),
    )


def column_for(column: ResultColumn) -> GrowingColumn:
    """An empty column of the kind."""
    if column.kind == "hash":
        return HashColumn(2 * HASH_BYTES)
    if column.kind in ("word", "value"):
        return ValueColumn()
    return NumberColumn(column.kind)


def _metric(name: str) -> ResultColumn:
    kind: Kind = "boolean" if name in _BOOLEANS else "integer" if name in _INTEGERS else "number"
    return ResultColumn(name, kind, metric_unit(name), "metric")


def metric_unit(name: str) -> str:
    """SI unit of a metric, "1" for pure numbers, "" for what has none.

    Args:
        name: One of `slipgrasp.core.run.result.metric_names`.
    """
    return next((unit for start, unit in _METRIC_UNITS.items() if name.startswith(start)), "")


def _varied(study: Study, key: str) -> ResultColumn:
    parameter = parameter_of(study, key)
    unit = "" if parameter is None else parameter.unit
    return ResultColumn(key, _kind_of(study, key), unit, "varied")


def _kind_of(study: Study, key: str) -> Kind:
    """Numbers where every value is one of the same kind, or any value."""
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
