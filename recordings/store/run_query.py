"""Queries of stored runs: conditions and order."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime, time
from typing import Self

from slipgrasp.core.run.metrics import metric_names
from slipgrasp.core.scenario import MAX_FINGERS
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError

FIGURES = ("end_time", *metric_names(MAX_FINGERS, soft=True))
"""Numbers for searching and sorting runs."""

SORT_KEYS = (
    "created",
    "title",
    "name",
    "preset",
    "controller",
    "outcome",
    "size",
    *FIGURES,
)

_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=|<|>|=)\s*([^\s<>=]+)\s*")
_WORDS = {"true": 1.0, "false": 0.0}


@dataclass(frozen=True, slots=True)
class Condition:
    """A bound on a metric of a run, such as ``slip_path_0 < 0.01``.

    Attributes:
        figure: One of `FIGURES`.
        operator: ``<``, ``<=``, ``>``, ``>=`` or ``=``.
        value: SI units; 1 for true, 0 for false.
    """

    figure: str
    operator: str
    value: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parses a condition.

        Raises:
            QueryError: If the text is not a condition, or its metric does not exist.
        """
        match = _CONDITION.fullmatch(text[:200])
        if match is None:
            raise QueryError(text, f"'{text[:80]}' is not a condition such as slip_path_0<0.01")
        figure, operator, number = match.groups()
        if figure not in FIGURES:
            raise QueryError(figure, f"there is no metric '{figure[:80]}'", FIGURES)
        try:
            value = _WORDS[number] if number in _WORDS else float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise QueryError(text, f"'{number[:80]}' is neither a finite number nor true or false")
        return cls(figure, operator, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunQuery:
    """A query of the stored runs; omitted fields match all runs.

    Attributes:
        preset: Name of the preset of the runs; empty matches runs without preset.
        controller: Kind of controller.
        outcome: Outcome of the run.
        tags: Required tags.
        created_from: Earliest creation time.
        created_to: Latest creation time.
        text: Part of title, display name or notes, case-insensitive.
        conditions: Bounds on metrics.
        sort: One of `SORT_KEYS`, descending with a leading ``-``; runs without the value come last.
        offset: Number of results to skip.
        limit: Largest number of results; all if None.
    """

    preset: str | None = None
    controller: str | None = None
    outcome: Outcome | None = None
    tags: tuple[str, ...] = ()
    created_from: datetime | None = None
    created_to: datetime | None = None
    text: str = ""
    conditions: tuple[Condition, ...] = ()
    sort: str = "-created"
    offset: int = 0
    limit: int | None = None

    def __post_init__(self) -> None:
        parse_sort(self.sort)

    @property
    def sort_key(self) -> str:
        """The sort key."""
        return self.sort.removeprefix("-")

    @property
    def is_falling(self) -> bool:
        """Whether the order is descending."""
        return self.sort.startswith("-")


def parse_sort(text: str) -> str:
    """Parses an order such as ``-created``.

    Raises:
        QueryError: If runs cannot be sorted by it.
    """
    key = text.removeprefix("-")
    if key not in SORT_KEYS:
        raise QueryError(key, f"runs cannot be sorted by '{key[:80]}'", SORT_KEYS)
    return text


def parse_instant(text: str) -> datetime:
    """Parses a time in ISO 8601, by default in UTC; a date is its first instant.

    Raises:
        QueryError: If the text is not a time.
    """
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        shown = text[:80]
        finding = f"'{shown}' is not a time in ISO 8601 such as 2026-01-31 or 2026-01-31T08:30:00Z"
        raise QueryError(text, finding) from error


def parse_end(text: str) -> datetime:
    """Parses a time in ISO 8601, by default in UTC; a date is its last instant.

    Raises:
        QueryError: If the text is not a time.
    """
    instant = parse_instant(text)
    is_date = len(text) <= len("2026-01-31")
    return datetime.combine(instant, time.max, UTC) if is_date else instant
