"""Intents about the comparison of two runs, and the answers of their worker."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.measured import Distances
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Pair


@dataclass(frozen=True, slots=True)
class CompareRuns(LatestIntent):
    """Requests an overlay of two runs; their ids are not validated yet.

    Attributes:
        a: Run to show; empty to keep the current one.
        b: Ghost; empty for none.
    """

    a: str
    b: str


@dataclass(frozen=True, slots=True)
class SwapRuns(Intent):
    """Swaps the run on the screen and the ghost."""


@dataclass(frozen=True, slots=True)
class EndComparison(Intent):
    """Dismisses the ghost."""


@dataclass(frozen=True, slots=True)
class RunsOpened(Intent):
    """Recordings are loaded for comparison.

    Attributes:
        number: Number of the request.
        a: Run to show; None to keep the current one.
        b: The ghost.
    """

    number: int
    a: Replay | None
    b: Replay


@dataclass(frozen=True, slots=True)
class CompareUnreadable(Intent):
    """A recording for comparison could not be opened."""

    number: int
    message: str


@dataclass(frozen=True, slots=True)
class RunsCompared(Intent):
    """The differences between two runs.

    Attributes:
        pair: The compared runs.
        findings: The differences; None if the runs cannot be compared.
        message: Reason why the runs cannot be compared.
        distances: Deviations of measured data from the run; None if both are runs.
    """

    pair: Pair
    findings: Comparison | None
    message: str = ""
    distances: Distances | None = None
