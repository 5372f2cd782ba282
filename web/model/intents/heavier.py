"""Intents about how much heavier the object may get."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class AskHowHeavy(Intent):
    """The user wants to know up to which mass the object is held."""


@dataclass(frozen=True, slots=True)
class HowHeavyFound(Intent):
    """The answer.

    Attributes:
        number: Which request it answers.
        words: It in a sentence.
    """

    number: int
    words: str
