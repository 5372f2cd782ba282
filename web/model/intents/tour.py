"""Intents about the tour of the presets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Interval

from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class ToggleTour(Intent):
    """The user begins the tour of the presets, or leaves it."""


@dataclass(frozen=True, slots=True)
class VisitStop(Intent):
    """The user goes to a stop of the tour, by its place; beyond the ends there is none."""

    place: Annotated[int, Interval(ge=0, le=1000)]
