"""Suggestions after a run, tried on the draft of the run."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.run.trying import TriedHint
from slipgrasp.core.scenario.custom_laws import LAW
from slipgrasp.core.words.options import Option
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.laws import with_law


@dataclass(frozen=True, slots=True)
class HintTrials:
    """The tried hint of the run on the screen.

    Attributes:
        draft: Draft of the run; None if nothing was tried yet.
        tried: Result; None while it is being tried.
    """

    draft: Draft | None = None
    tried: TriedHint | None = None

    def of(self, draft: Draft) -> TriedHint | None:
        """The tried hint of a draft; None if there is none."""
        return self.tried if self.draft is draft else None


def followed(draft: Draft, option: Option) -> Draft:
    """The draft with an option of a hint applied to the whole run."""
    if LAW in option.values:
        draft = with_law(draft, str(option.values[LAW]), None)
    for key, value in option.values.items():
        draft = draft if key == LAW else draft.edited(key, value)
    return draft
