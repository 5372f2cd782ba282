"""Answers of the worker: runs and their storage."""

from __future__ import annotations

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import StoredRun
from slipgrasp.web.model.intents.intent import Intent


class RunFinished(Intent):
    """A run is ready.

    Attributes:
        ticket: The request.
        result: The run.
        elapsed: Computing time [s].
    """

    ticket: int
    result: RunResult
    elapsed: float


class RunRefused(Intent):
    """A scenario could not be simulated."""

    ticket: int
    error: ScenarioError


class RunSaved(Intent):
    """A run was stored."""

    ticket: int
    stored: StoredRun


class SaveFailed(Intent):
    """A run could not be stored, with the reason."""

    ticket: int
    message: str
