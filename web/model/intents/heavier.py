"""Intents about the largest mass with which the object is held."""

from __future__ import annotations

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent


class AskHowHeavy(Intent, right=Right.EVERYTHING):
    """Requests the largest mass with which the object is held."""


class HowHeavyFound(Intent):
    """The result of the search.

    Attributes:
        number: Number of the request.
        words: Result in a sentence.
    """

    number: int
    words: str
