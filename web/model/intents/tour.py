"""Intents about the tour of the presets."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Interval

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent


class ToggleTour(Intent, right=Right.EVERYTHING):
    """Starts or leaves the tour of the presets."""


class VisitStop(Intent, right=Right.EVERYTHING):
    """Moves to a stop of the tour by index; invalid indices are ignored."""

    place: Annotated[int, Interval(ge=0, le=1000)]
