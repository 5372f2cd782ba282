"""Which of the stored runs are asked for, and in which order."""

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
"""Numbers that a run can be searched and sorted by."""

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
    """A bound on a figure of a run, such as ``slip_path_0 < 0.01``.

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
        """The condition that a text states.

        Raises:
            QueryError: If it states none, or about something that no run has.
        """
        match = _CONDITION.fullmatch(text[:200])
        if match is None:
            raise QueryError(text, f"'{text[:80]}' is no condition such as slip_path_0<0.01")
        figure, operator, number = match.groups()
        if figure not in FIGURES:
            raise QueryError(figure, f"there is no metric '{figure[:80]}'", FIGURES)
        try:
            value = _WORDS[number] if number in _WORDS else float(number)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise QueryError(text, f"'{number[:80]}' is no finite number, and not true or false")
        return cls(figure, operator, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunQuery:
    """A search of the stored runs; what is left out does not narrow it.

    Attributes:
        preset: Name of the preset they were made from; empty finds those made from none.
        controller: Kind of their controller.
        outcome: How they ended.
        tags: Tags that they all have.
        created_from: Made then or later.
        created_to: Made before or then.
        text: Part of title, display name or notes, in letters of any case.
        conditions: Bounds on their figures.
        sort: One of `SORT_KEYS`, falling if it begins with ``-``; runs without it come last.
        offset: How many of those found to leave out.
        limit: How many to give at most; all if None.
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
        """What is sorted by."""
        return self.sort.removeprefix("-")

    @property
    def is_falling(self) -> bool:
        """Whether the largest come first."""
        return self.sort.startswith("-")


def parse_sort(text: str) -> str:
    """An order such as ``-created``.

    Raises:
        QueryError: If runs cannot be sorted so.
    """
    key = text.removeprefix("-")
    if key not in SORT_KEYS:
        raise QueryError(key, f"runs cannot be sorted by '{key[:80]}'", SORT_KEYS)
    return text


def parse_instant(text: str) -> datetime:
    """A time in ISO 8601; in UTC unless it says otherwise; of a date alone its first instant.

    Raises:
        QueryError: If it is no time.
    """
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        shown = text[:80]
        finding = f"'{shown}' is no time in ISO 8601 such as 2026-01-31 or 2026-01-31T08:30:00Z"
        raise QueryError(text, finding) from error


def parse_end(text: str) -> datetime:
    """A time in ISO 8601; in UTC unless it says otherwise; of a date alone its last instant.

    Raises:
        QueryError: If it is no time.
    """
    instant = parse_instant(text)
    is_date = len(text) <= len("2026-01-31")
    return datetime.combine(instant, time.max, UTC) if is_date else instant
