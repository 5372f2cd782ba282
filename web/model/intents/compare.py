"""Intents about the comparison of two runs, and the answers of their worker."""

from __future__ import annotations

from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.measured import Distances
from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Pair


class CompareRuns(LatestIntent):
    """Requests an overlay of two runs; their ids are not validated yet.

    Attributes:
        a: Run to show; empty to keep the current one.
        b: Ghost; empty for none.
    """

    a: str
    b: str


class SwapRuns(Intent, right=Right.READ):
    """Swaps the run on the screen and the ghost."""


class EndComparison(Intent, right=Right.READ):
    """Dismisses the ghost."""


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


class CompareUnreadable(Intent):
    """A recording for comparison could not be opened."""

    number: int
    message: str


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
