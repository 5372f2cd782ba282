"""Format of a study in a TOML file, a request, or a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.scenario.field_errors import shortened, single_error
from slipgrasp.core.scenario.field_types import CONFIG
from slipgrasp.core.study.definition import KeptRecordings, Sampling

MAX_AXES = 20
MAX_LISTED = 10_000
MAX_VALUES = 10_000

_EXAMPLE = {
    "base": "paper-case-2",
    "sampling": {"method": "latin-hypercube", "runs": 200, "seed": 1},
    "vary": {
        "object.mass": {"min": 0.5, "max": 2.0},
        "controller.lyapunov_weight": {"values": [1.0, 20.0]},
    },
}

Key = Annotated[str, Field(min_length=1, max_length=80)]
Text = Annotated[str, Field(max_length=200)]
Numbers = Annotated[list[float], Field(max_length=100)]
PlainValue = bool | float | int | Text | Numbers
PlainValues = Annotated[dict[Key, PlainValue], Field(max_length=100)]


class AxisDocument(BaseModel):
    """Variation of one parameter: `values`, or `min` and `max`."""

    model_config = CONFIG

    values: Annotated[
        list[PlainValue] | None,
        Field(
            min_length=1,
            max_length=MAX_VALUES,
            description="values of the parameter, each combined with every sample",
        ),
    ] = None
    min: Annotated[float | None, Field(description="lower bound, in the parameter's unit")] = None
    max: Annotated[float | None, Field(description="upper bound, in the parameter's unit")] = None
    count: Annotated[
        int | None,
        Field(ge=1, le=10**15, description="number of grid values from min to max, including both"),
    ] = None
    scale: Annotated[
        Literal["linear", "log"],
        Field(description="whether a range is divided linearly or logarithmically"),
    ] = "linear"


class StudyDocument(BaseModel):
    """A base scenario, its variations, and the recordings to store."""

    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, json_schema_extra={"example": _EXAMPLE}
    )

    title: Annotated[str, Field(max_length=200, description="description of the study")] = ""
    base: Annotated[
        Annotated[str, Field(max_length=4096)] | dict[str, Any],
        Field(description="name of a preset, or a complete scenario"),
    ]
    set: Annotated[
        PlainValues, Field(description="values that differ from the base, by dotted key")
    ] = {}
    sampling: Sampling = Sampling()
    vary: Annotated[
        dict[Key, AxisDocument],
        Field(
            max_length=MAX_AXES,
            description="varied parameters by dotted key; fingers.*.friction sets all fingers "
            "equally",
        ),
    ] = {}
    runs: Annotated[
        list[PlainValues], Field(max_length=MAX_LISTED, description="the runs of a list")
    ] = []
    limits: Annotated[
        dict[str, Annotated[float, Field(ge=0.0)]],
        Field(
            max_length=MAX_AXES,
            description="largest magnitude of a metric, such as slip_path; an object past a limit "
            "counts as not held",
        ),
    ] = {}
    recordings: Annotated[
        KeptRecordings | None,
        Field(
            description="runs whose recording is stored; by default all of up to 1000 runs, none "
            "of more"
        ),
    ] = None


def plain_value(value: Any) -> Any:
    """Converts a value to the form in scenarios: a list of numbers becomes a tuple."""
    return tuple(value) if isinstance(value, list) else value


def flatten(document: Any) -> Any:
    """Joins nested tables to dotted keys, because TOML nests keys without quotes.

    Args:
        document: A study as plain values; anything else is returned unchanged.

    Raises:
        ScenarioError: If a key occurs both with and without quotes.
    """
    if not isinstance(document, Mapping):
        return document
    flat = dict(document)
    if isinstance(flat.get("vary"), Mapping):
        flat["vary"] = _joined("vary", flat["vary"], _is_axis)
    if isinstance(flat.get("set"), Mapping):
        flat["set"] = _joined("set", flat["set"], _is_empty)
    if isinstance(flat.get("runs"), list):
        flat["runs"] = [
            _joined(f"runs.{index}", run, _is_empty) if isinstance(run, Mapping) else run
            for index, run in enumerate(flat["runs"])
        ]
    return flat


def _joined(
    field: str, table: Mapping[Any, Any], is_value: Callable[[Mapping[Any, Any]], bool]
) -> dict[Any, Any]:
    joined: dict[Any, Any] = {}
    for key, value in _pairs(table, is_value):
        if key in joined:
            message = f"{field}.{shortened(str(key))} occurs twice; remove one"
            raise single_error(f"{field}.{shortened(str(key))}", None, "once", message)
        joined[key] = value
    return joined


def _pairs(
    table: Mapping[Any, Any], is_value: Callable[[Mapping[Any, Any]], bool], depth: int = 8
) -> Iterator[tuple[Any, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping) and depth > 0 and not is_value(value):
            for rest, inner in _pairs(value, is_value, depth - 1):
                yield f"{key}.{rest}", inner
        else:
            yield key, value


def _is_empty(table: Mapping[Any, Any]) -> bool:
    return not table


def _is_axis(table: Mapping[Any, Any]) -> bool:
    """Whether a table describes the variation of a parameter, even with a typing error."""
    fields = list(AxisDocument.model_fields)
    return not table or any(get_close_matches(str(key), fields, n=1, cutoff=0.6) for key in table)
