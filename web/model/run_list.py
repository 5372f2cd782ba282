"""The list of stored runs: filter and selection."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.store.run_query import Condition, RunQuery
from slipgrasp.recordings.store.stored_run import StoredRun

ROWS_PER_PAGE = 12
MAX_TEXT = 100

_ANY = "any outcome"
_HELD = {"held": 1.0, "not held": 0.0}
_ENDED = {
    outcome.replace("_", " "): outcome for outcome in Outcome if outcome is not Outcome.COMPLETED
}

OUTCOME_CHOICES = (_ANY, *_HELD, *_ENDED)
"""Outcomes to choose from."""


@dataclass(frozen=True, slots=True)
class RunFilter:
    """Filter of stored runs.

    Attributes:
        text: Part of name or tags, case-insensitive.
        outcome: One of `OUTCOME_CHOICES`; other text selects the first.
    """

    text: str = ""
    outcome: str = _ANY

    @property
    def is_open(self) -> bool:
        """Whether it matches every run."""
        return not self.text.strip() and self.outcome not in (*_HELD, *_ENDED)

    def query(self, page: int) -> RunQuery:
        """The query for a page; 0 is the newest."""
        outcome = _ENDED.get(self.outcome)
        held = self.outcome in _HELD
        return RunQuery(
            text=self.text.strip()[:MAX_TEXT],
            outcome=Outcome.COMPLETED if held else outcome,
            conditions=(Condition("held", "=", _HELD[self.outcome]),) if held else (),
            offset=page * ROWS_PER_PAGE,
            limit=ROWS_PER_PAGE,
        )


@dataclass(frozen=True, slots=True)
class Notice:
    """The result of the latest request about stored runs: a title, and a sentence."""

    title: str
    message: str


@dataclass(frozen=True, slots=True)
class RunList:
    """The shown page of stored runs.

    Attributes:
        page: Index of the page; 0 is the newest.
        count: Number of runs on all pages.
        runs: Runs of this page.
        wanted: The filter.
        chosen_id: The selected run, empty if there is none.
        chosen: Its description, once known.
        recent: The newest runs, regardless of the filter.
        notice: Reason why the latest request failed; empty if it did not.
    """

    page: int = 0
    count: int = 0
    runs: tuple[StoredRun, ...] = ()
    wanted: RunFilter = RunFilter()
    chosen_id: str = ""
    chosen: StoredRun | None = None
    recent: tuple[StoredRun, ...] = ()
    notice: Notice | None = None
