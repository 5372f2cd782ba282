"""Intents about the assumptions of the paper's theorems, and the answer of their worker."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class FindPremises(LatestIntent):
    """The user wants to know what the theorems suppose of the run on the screen."""


@dataclass(frozen=True, slots=True)
class PremisesFound(Intent):
    """The worker has found it.

    Attributes:
        ticket: The run that it is true of.
        sentences: What the theorems suppose and promise, and what the run did.
    """

    ticket: int
    sentences: tuple[str, ...]
