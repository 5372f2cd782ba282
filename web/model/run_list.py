"""The stored runs as a user looks at them: which are asked for, which is chosen."""

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
"""Words for how runs went, to choose from."""


@dataclass(frozen=True, slots=True)
class RunFilter:
    """Which stored runs are listed.

    Attributes:
        text: Part of what they are called or tagged, in letters of any case.
        outcome: One of `OUTCOME_CHOICES`; any other text is as good as the first.
    """

    text: str = ""
    outcome: str = _ANY

    @property
    def is_open(self) -> bool:
        """Whether it lets every run through."""
        return not self.text.strip() and self.outcome not in (*_HELD, *_ENDED)

    def query(self, page: int) -> RunQuery:
        """What to ask the store for a page, 0 has the newest."""
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
    """What became of the latest request about stored runs: a title, and a sentence."""

    title: str
    message: str


@dataclass(frozen=True, slots=True)
class RunList:
    """The page of the stored runs that the user looks at.

    Attributes:
        page: Which page, 0 has the newest.
        count: How many runs there are on all pages.
        runs: Those of this page.
        wanted: Which runs are listed.
        chosen_id: The run that the user has chosen, empty if none.
        chosen: Its description, once known.
        recent: The newest runs, whatever is listed.
        notice: Why the latest request was not done, if so.
    """

    page: int = 0
    count: int = 0
    runs: tuple[StoredRun, ...] = ()
    wanted: RunFilter = RunFilter()
    chosen_id: str = ""
    chosen: StoredRun | None = None
    recent: tuple[StoredRun, ...] = ()
    notice: Notice | None = None
