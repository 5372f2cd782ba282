"""Intents about the assumptions of the paper's theorems, and the answer of their worker."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class FindPremises(LatestIntent):
    """Requests the assumptions of the theorems for the run on the screen."""


@dataclass(frozen=True, slots=True)
class PremisesFound(Intent):
    """The result of the worker.

    Attributes:
        ticket: The run.
        sentences: The assumptions and bounds, compared with the run.
    """

    ticket: int
    sentences: tuple[str, ...]
