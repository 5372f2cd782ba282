"""Intents about the hint of the run on the screen."""

from __future__ import annotations

from slipgrasp.core.run.trying import TriedHint
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


class TryHints(LatestIntent):
    """The user may start simulations, so that hints can be tried."""


class HintTried(Intent):
    """The options of a hint were tried.

    Attributes:
        number: Number of the request.
        tried: Result.
    """

    number: int
    tried: TriedHint
