"""What the worker answers: runs, and where they are kept."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import StoredRun
from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class RunFinished(Intent):
    """A run is there to be shown.

    Attributes:
        ticket: Which request it answers.
        result: The run.
        elapsed: How long it was computed [s].
    """

    ticket: int
    result: RunResult
    elapsed: float


@dataclass(frozen=True, slots=True)
class RunRefused(Intent):
    """A run could not be made of its scenario."""

    ticket: int
    error: ScenarioError


@dataclass(frozen=True, slots=True)
class RunSaved(Intent):
    """A run is on disk."""

    ticket: int
    stored: StoredRun


@dataclass(frozen=True, slots=True)
class SaveFailed(Intent):
    """A run could not be written, with the reason."""

    ticket: int
    message: str
