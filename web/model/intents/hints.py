"""What the worker answers about the hint of the run on the screen."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.run.trying import TriedHint
from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class HintTried(Intent):
    """The options of a hint were tried.

    Attributes:
        number: Which request this answers.
        tried: What came of it.
    """

    number: int
    tried: TriedHint
