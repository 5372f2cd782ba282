"""What the worker answers about the laws side by side."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.laws_view import LawRun


@dataclass(frozen=True, slots=True)
class LawRunFinished(Intent):
    """The run with one law is there, or why it is not.

    Attributes:
        number: Which request it answers.
        run: The run.
    """

    number: int
    run: LawRun
