"""View model of fits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.jobs.job import StudyState

_WORDS = {
    StudyState.QUEUED: "Waiting for its turn.",
    StudyState.COMPLETED: "Complete.",
    StudyState.CANCELLED: "Cancelled.",
    StudyState.FAILED: "Failed.",
}


@dataclass(frozen=True, slots=True)
class FitDraft:
    """Input of a fit by the user, not yet validated.

    Attributes:
        recording: Id of the recording.
        free: Keys of the parameters, separated by commas.
        signals: Signals with their noise, such as ``slip:2e-4``, separated by commas.
        starts: Number of starts.
    """

    recording: str
    free: str
    signals: str
    starts: int


@dataclass(frozen=True, slots=True)
class ShownProfile:
    """Profile and estimate of a parameter.

    Attributes:
        key: The parameter.
        points: Values, increasing, and the rise of chi-squared there.
        threshold: Rise at the ends of the interval.
        words: The estimate in words.
    """

    key: str
    points: tuple[tuple[float, float], ...]
    threshold: float
    words: str


@dataclass(frozen=True, slots=True, eq=False)
class FitView:
    """Fits in the view of a session.

    Attributes:
        status: The displayed fit; None if there is none.
        report: Its report, once it is complete.
        listed: The newest fits of the store.
        message: Reason why a fit cannot be started or shown; empty if it can.
        is_starting: Whether a request is being checked.
    """

    status: FitStatus | None = None
    report: dict[str, Any] | None = None
    listed: tuple[FitStatus, ...] = ()
    message: str = ""
    is_starting: bool = False


def progress_words(status: FitStatus) -> str:
    """The state of a fit in words."""
    runs = f"{status.finished} runs"
    if status.state is StudyState.RUNNING:
        progress = status.progress
        return f"Fitting: {progress.stage}, {progress.share:.0%}; {runs}."
    return f"{_WORDS[status.state]} {runs}." + (f" {status.message}" if status.message else "")


def fit_label(status: FitStatus) -> str:
    """A fit in a list."""
    request = status.stored.request
    return f"{request.title or ', '.join(request.free)} · {status.state} · {status.stored.id}"
