"""Intents about the largest mass with which the object is held."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class AskHowHeavy(Intent):
    """Requests the largest mass with which the object is held."""


@dataclass(frozen=True, slots=True)
class HowHeavyFound(Intent):
    """The result of the search.

    Attributes:
        number: Number of the request.
        words: Result in a sentence.
    """

    number: int
    words: str
