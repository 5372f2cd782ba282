"""Intents about the play head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import MaxLen

from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.playback import WindowChoice

Direction = Literal[-1, 1]


@dataclass(frozen=True, slots=True)
class TogglePlay(Intent):
    """Play or pause."""


@dataclass(frozen=True, slots=True)
class Seek(LatestIntent):
    """Moves the play head to a time [s]."""

    time: float


@dataclass(frozen=True, slots=True)
class Step(Intent):
    """Moves to the next (1) or the previous (-1) row of the trace."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class JumpToEvent(Intent):
    """Moves to the next (1) or the previous (-1) event."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class GoToNextSlip(Intent):
    """Moves to the next onset of slip; after the last one to the first."""


@dataclass(frozen=True, slots=True)
class GoToEdge(LatestIntent):
    """Moves to the end (1) or the start (-1) of the time range."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class SetSpeed(LatestIntent):
    """Selects a playback speed by name."""

    name: Annotated[str, MaxLen(10)]


@dataclass(frozen=True, slots=True)
class ChangeSpeed(Intent):
    """Increases (1) or decreases (-1) the speed."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class ChooseWindow(LatestIntent):
    """Selects the time range to play and chart."""

    choice: Literal[WindowChoice.SLIP, WindowChoice.WHOLE]


@dataclass(frozen=True, slots=True)
class ShowWindow(LatestIntent):
    """Selects the time range to play and chart, from start to end [s]."""

    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Zoom(Intent):
    """Zooms in at the play head."""
