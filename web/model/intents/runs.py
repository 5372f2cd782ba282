"""Answers of the worker: runs and their storage."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import StoredRun
from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class RunRefused(Intent):
    """A scenario could not be simulated."""

    ticket: int
    error: ScenarioError


@dataclass(frozen=True, slots=True)
class RunSaved(Intent):
    """A run was stored."""

    ticket: int
    stored: StoredRun


@dataclass(frozen=True, slots=True)
class SaveFailed(Intent):
    """A run could not be stored, with the reason."""

    ticket: int
    message: str
