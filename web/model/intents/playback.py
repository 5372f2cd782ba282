"""Intents about the play head."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import MaxLen

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.playback import WindowChoice

Direction = Literal[-1, 1]


class TogglePlay(Intent, right=Right.READ):
    """Play or pause."""


class Seek(LatestIntent, right=Right.READ):
    """Moves the play head to a time [s]."""

    time: float


class Step(Intent, right=Right.READ):
    """Moves to the next (1) or the previous (-1) row of the trace."""

    direction: Direction


class JumpToEvent(Intent, right=Right.READ):
    """Moves to the next (1) or the previous (-1) event."""

    direction: Direction


class GoToNextSlip(Intent, right=Right.READ):
    """Moves to the next onset of slip; after the last one to the first."""


class GoToEdge(LatestIntent, right=Right.READ):
    """Moves to the end (1) or the start (-1) of the time range."""

    direction: Direction


class SetSpeed(LatestIntent, right=Right.READ):
    """Selects a playback speed by name."""

    name: Annotated[str, MaxLen(10)]


class ChangeSpeed(Intent, right=Right.READ):
    """Increases (1) or decreases (-1) the speed."""

    direction: Direction


class ChooseWindow(LatestIntent, right=Right.READ):
    """Selects the time range to play and chart."""

    choice: Literal[WindowChoice.SLIP, WindowChoice.WHOLE]


class ShowWindow(LatestIntent, right=Right.READ):
    """Selects the time range to play and chart, from start to end [s]."""

    start: float
    end: float


class Zoom(Intent, right=Right.READ):
    """Zooms in at the play head."""
