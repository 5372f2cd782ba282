"""Intents about the hint of the run on the screen."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.run.trying import TriedHint
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class TryHints(LatestIntent):
    """The page is of somebody who may have runs simulated, so hints are to be tried for it."""


@dataclass(frozen=True, slots=True)
class HintTried(Intent):
    """The options of a hint were tried.

    Attributes:
        number: Which request this answers.
        tried: What came of it.
    """

    number: int
    tried: TriedHint
