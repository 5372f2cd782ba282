"""A study as it is written down: in a TOML file, in a request, in a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.scenario.field_errors import shortened, single_error
from slipgrasp.core.study.definition import KeptRecordings, Method

MAX_AXES = 20
MAX_LISTED = 10_000
MAX_VALUES = 10_000

_CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
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
    """How one parameter varies: `values`, or `min` and `max`."""

    model_config = _CONFIG

    values: Annotated[
        list[PlainValue] | None,
        Field(
            min_length=1,
            max_length=MAX_VALUES,
            description="the values it takes, each tried on every sample",
        ),
    ] = None
    min: Annotated[float | None, Field(description="lower bound, in the parameter's unit")] = None
    max: Annotated[float | None, Field(description="upper bound, in the parameter's unit")] = None
    count: Annotated[
        int | None,
        Field(ge=1, le=10**15, description="values from min to max, both included, of a grid"),
    ] = None
    scale: Annotated[
        Literal["linear", "log"],
        Field(description="whether a range is divided evenly, or evenly in its logarithm"),
    ] = "linear"


class SamplingDocument(BaseModel):
    """How the runs are found."""

    model_config = _CONFIG

    method: Annotated[
        Method,
        Field(
            description="grid: every combination; list: `runs` one by one; random and "
            "latin-hypercube: samples between min and max"
        ),
    ] = "grid"
    runs: Annotated[
        int | None, Field(ge=1, le=10**15, description="how many samples; not for a grid or list")
    ] = None
    seed: Annotated[
        int, Field(ge=0, le=2**53 - 1, description="the same seed gives the same samples")
    ] = 0


class StudyDocument(BaseModel):
    """A base scenario, how it varies, and what is kept."""

    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, json_schema_extra={"example": _EXAMPLE}
    )

    title: Annotated[str, Field(max_length=200, description="what it is about")] = ""
    base: Annotated[
        Annotated[str, Field(max_length=4096)] | dict[str, Any],
        Field(description="name of a preset, or a whole scenario"),
    ]
    set: Annotated[
        PlainValues, Field(description="what is changed in the base, by dotted key")
    ] = {}
    sampling: SamplingDocument = SamplingDocument()
    vary: Annotated[
        dict[Key, AxisDocument],
        Field(
            max_length=MAX_AXES,
            description="what varies, by dotted key; fingers.*.friction sets all fingers alike",
        ),
    ] = {}
    runs: Annotated[
        list[PlainValues], Field(max_length=MAX_LISTED, description="the runs of a list")
    ] = []
    recordings: Annotated[
        KeptRecordings | None,
        Field(description="of which runs the recording is kept; all up to 1000 runs, then none"),
    ] = None


def plain_value(value: Any) -> Any:
    """A value as scenarios hold it: a list of numbers is a tuple."""
    return tuple(value) if isinstance(value, list) else value


def flatten(document: Any) -> Any:
    """Joins tables in tables to dotted keys, as TOML makes them of keys without quotes.

    Args:
        document: A study as plain values; anything else is returned unchanged.

    Raises:
        ScenarioError: If a key stands there both with and without quotes.
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
            message = f"{field}.{shortened(str(key))} stands there twice; leave one out"
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
    """Whether a table is meant to say how a parameter varies, be it with a slip of the pen."""
    fields = list(AxisDocument.model_fields)
    return not table or any(get_close_matches(str(key), fields, n=1, cutoff=0.6) for key in table)
