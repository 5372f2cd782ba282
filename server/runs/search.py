"""REST parameters for searching stored runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.field_errors import nearest, template_keys
from slipgrasp.core.scenario.loading import all_preset_names
from slipgrasp.core.scenario.supported import NO_CONTROLLER
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.store.annotations import MAX_TAGS, RunTag
from slipgrasp.recordings.store.run_query import (
    Condition,
    RunQuery,
    parse_end,
    parse_instant,
    parse_sort,
)
from slipgrasp.server.exceptions import InvalidRequestError, printable
from slipgrasp.server.paging import Limit, Offset

MAX_CONDITIONS = 20

Value = TypeVar("Value")
Text = Annotated[str, Field(max_length=200)]


class RunsQuery(BaseModel):
    """A search of stored runs; omitted fields match all runs."""

    # Unknown names are rejected by `to_query`, which suggests others.
    model_config = ConfigDict(extra="allow")

    limit: Limit = 100
    offset: Offset = 0
    sort: Annotated[
        Text,
        Field(
            description="created, title, name, preset, controller, outcome, size, end_time or a "
            "metric as in `metric`; '-' before it for descending order; runs without it come last",
            examples=["-created", "slip_path_0"],
        ),
    ] = "-created"
    preset: Annotated[
        Text | None, Field(description="based on this preset", examples=["paper-case-1"])
    ] = None
    controller: Annotated[
        Text | None, Field(description="kind of the controller", examples=["theorem-4"])
    ] = None
    outcome: Annotated[Text | None, Field(description="ended so", examples=["completed"])] = None
    tag: Annotated[
        list[RunTag],
        Field(max_length=MAX_TAGS, description="with this tag; may be repeated"),
    ] = []
    created_from: Annotated[
        Text | None,
        Field(
            description="earliest time of storage, ISO 8601, UTC by default",
            examples=["2026-01-31"],
        ),
    ] = None
    created_to: Annotated[
        Text | None,
        Field(description="latest time of storage; a date alone includes the whole day"),
    ] = None
    text: Annotated[
        str,
        Field(max_length=200, description="part of title, display name or notes, case-insensitive"),
    ] = ""
    metric: Annotated[
        list[Text],
        Field(
            max_length=MAX_CONDITIONS,
            description="a bound such as slip_path_0<0.01, held=true or end_time>=5 (<, <=, >, "
            ">=, =; SI units); metrics with one value per contact end in _0, _1, …, those with "
            "one per coordinate in _x, _y, _theta; may be repeated",
            examples=["slip_path_0<0.01"],
        ),
    ] = []

    def to_query(self) -> RunQuery:
        """The search query.

        Raises:
            InvalidRequestError: With one item per wrong field.
        """
        findings = _Findings([_unknown_field(name) for name in self.model_extra or {}])
        conditions = [findings.parsed("metric", Condition.parse, text) for text in self.metric]
        query = RunQuery(
            preset=findings.parsed("preset", _parse_preset, self.preset),
            controller=findings.parsed("controller", _parse_controller, self.controller),
            outcome=findings.parsed("outcome", _parse_outcome, self.outcome),
            tags=tuple(self.tag),
            created_from=findings.parsed("created_from", parse_instant, self.created_from),
            created_to=findings.parsed("created_to", parse_end, self.created_to),
            text=self.text,
            conditions=tuple(condition for condition in conditions if condition is not None),
            sort=findings.parsed("sort", parse_sort, self.sort) or "created",
            offset=self.offset,
            limit=self.limit,
        )
        if findings.errors:
            raise InvalidRequestError(findings.errors)
        return query


@dataclass(slots=True)
class _Findings:
    """Errors of the fields parsed so far."""

    errors: list[FieldError]

    def parsed(self, field: str, parse: Callable[[str], Value], text: str | None) -> Value | None:
        """A value, None if it was not given or is invalid."""
        try:
            return None if text is None else parse(text)
        except QueryError as error:
            limit = f"one of {', '.join(error.known)}" if error.known else None
            message = f"{field}: {error}{nearest(error.value, error.known)}"
            value = printable(error.value)
            self.errors.append(
                FieldError(field=field, value=value, limit=limit, message=printable(message, 300))
            )
            return None


def _unknown_field(name: str) -> FieldError:
    field = printable(name)
    message = f"unknown field '{field}'{nearest(name, RunsQuery.model_fields)}"
    return FieldError(field=field, value=None, limit=None, message=message)


def _parse_preset(text: str) -> str:
    return _chosen(text, "preset", ("", *all_preset_names()))


def _parse_controller(text: str) -> str:
    kinds = *template_keys()["controller.kind"].choices, NO_CONTROLLER
    return _chosen(text, "controller", kinds)


def _parse_outcome(text: str) -> Outcome:
    return Outcome(_chosen(text, "outcome", [outcome.value for outcome in Outcome]))


def _chosen(text: str, what: str, known: Sequence[str]) -> str:
    if text not in known:
        raise QueryError(text, f"there is no {what} '{text}'", [word for word in known if word])
    return text
