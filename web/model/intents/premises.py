"""Intents about the assumptions of the paper's theorems, and the answer of their worker."""

from __future__ import annotations

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


class FindPremises(LatestIntent, right=Right.READ):
    """Requests the assumptions of the theorems for the run on the screen."""


class PremisesFound(Intent):
    """The result of the worker.

    Attributes:
        ticket: The run.
        sentences: The assumptions and bounds, compared with the run.
    """

    ticket: int
    sentences: tuple[str, ...]
