"""Intents about the tour of the presets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Interval

from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class ToggleTour(Intent):
    """Starts or leaves the tour of the presets."""


@dataclass(frozen=True, slots=True)
class VisitStop(Intent):
    """Moves to a stop of the tour by index; invalid indices are ignored."""

    place: Annotated[int, Interval(ge=0, le=1000)]
