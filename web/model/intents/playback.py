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
    """The user put the play head to a time [s]."""

    time: float


@dataclass(frozen=True, slots=True)
class Step(Intent):
    """The user wants the next (1) or the previous (-1) row of the trace."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class JumpToEvent(Intent):
    """The user wants the next (1) or the previous (-1) event."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class GoToNextSlip(Intent):
    """The user wants the next onset of slip; after the last the first."""


@dataclass(frozen=True, slots=True)
class GoToEdge(LatestIntent):
    """The user wants the end (1) or the start (-1) of what is played."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class SetSpeed(LatestIntent):
    """The user chose how fast to play, by the name of a speed."""

    name: Annotated[str, MaxLen(10)]


@dataclass(frozen=True, slots=True)
class ChangeSpeed(Intent):
    """The user wants to play faster (1) or slower (-1)."""

    direction: Direction


@dataclass(frozen=True, slots=True)
class ChooseWindow(LatestIntent):
    """The user chose the time range of the run to play and chart."""

    choice: Literal[WindowChoice.SLIP, WindowChoice.WHOLE]


@dataclass(frozen=True, slots=True)
class ShowWindow(LatestIntent):
    """The user marked the time range of the run to play and chart, from start to end [s]."""

    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Zoom(Intent):
    """The user wants a closer look at the time around the play head."""
