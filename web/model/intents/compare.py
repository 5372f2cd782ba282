"""Intents about the comparison of two runs, and what their worker answers."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.measured import Distances
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Pair


@dataclass(frozen=True, slots=True)
class CompareRuns(LatestIntent):
    """The user wants to see two runs over each other; their ids are not validated yet.

    Attributes:
        a: The one on the screen; empty if it is to stay as it is.
        b: The ghost; empty for none.
    """

    a: str
    b: str


@dataclass(frozen=True, slots=True)
class SwapRuns(Intent):
    """The user swaps the run on the screen and the ghost."""


@dataclass(frozen=True, slots=True)
class EndComparison(Intent):
    """The user dismisses the ghost."""


@dataclass(frozen=True, slots=True)
class RunsOpened(Intent):
    """Recordings are there to be compared.

    Attributes:
        number: Which request this answers.
        a: The one to put on the screen; None if that is to stay as it is.
        b: The ghost.
    """

    number: int
    a: Replay | None
    b: Replay


@dataclass(frozen=True, slots=True)
class CompareUnreadable(Intent):
    """A recording could not be opened to be compared, with the reason."""

    number: int
    message: str


@dataclass(frozen=True, slots=True)
class RunsCompared(Intent):
    """The differences between two runs.

    Attributes:
        pair: Which runs.
        findings: None if they cannot be compared.
        message: Why not.
        distances: How far measured data are from the run; None if both are runs.
    """

    pair: Pair
    findings: Comparison | None
    message: str = ""
    distances: Distances | None = None
