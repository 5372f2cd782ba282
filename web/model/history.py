"""What was asked for before, and what was taken back: undo and redo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from slipgrasp.web.model.draft import Draft

_REMEMBERED = 200


class Turn(NamedTuple):
    """What undo or redo leads to."""

    draft: Draft
    history: History


@dataclass(frozen=True, slots=True)
class History:
    """Drafts before and after the present one; the oldest are forgotten.

    Attributes:
        past: Earlier drafts, the latest last.
        future: Drafts that were taken back, the next one last.
    """

    past: tuple[Draft, ...] = ()
    future: tuple[Draft, ...] = ()

    def with_past(self, present: Draft) -> History:
        """The history once something new follows the present draft."""
        return History((*self.past, present)[-_REMEMBERED:])

    def undo(self, present: Draft) -> Turn | None:
        """One step back; None where there is none."""
        if not self.past:
            return None
        return Turn(self.past[-1], History(self.past[:-1], (*self.future, present)))

    def redo(self, present: Draft) -> Turn | None:
        """One step forth again; None where there is none."""
        if not self.future:
            return None
        return Turn(self.future[-1], History((*self.past, present), self.future[:-1]))
