"""Thread that simulates and stores runs, for a session."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.server.exceptions import MemoryLimitError, ServiceBusyError
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.runs import RunFinished, RunRefused, RunSaved, SaveFailed
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.saved_runs import SavedRuns
from slipgrasp.web.workers.worker import Worker

_INTERNAL_ERROR = "an internal error; see the server's log"

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Simulate:
    ticket: int
    scenario: Scenario


@dataclass(frozen=True, slots=True)
class _Save:
    ticket: int
    result: RunResult


class PreviewWorker(Worker):
    """Simulates the latest requested scenario, and stores runs on request.

    Args:
        live: Simulates scenarios.
        saved: Stores runs.
        send: Receives the results.
    """

    def __init__(self, live: LiveRuns, saved: SavedRuns, send: Send) -> None:
        self._live = live
        self._saved = saved
        self._send = send
        self._wake = threading.Condition()
        self._simulation: _Simulate | None = None
        self._save: _Save | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="preview", daemon=True)
        self._thread.start()

    def simulate(self, ticket: int, scenario: Scenario) -> None:
        """Requests a run, which replaces an older request."""
        with self._wake:
            self._simulation = _Simulate(ticket, scenario)
            self._wake.notify()

    def save(self, ticket: int, result: RunResult) -> None:
        """Requests to store a run."""
        with self._wake:
            self._save = _Save(ticket, result)
            self._wake.notify()

    def close(self) -> None:
        """Cancels the current run; runs to be stored are still saved."""
        with self._wake:
            self._closed = True
            self._wake.notify()

    def join(self, timeout: float) -> None:
        """Waits until the thread has ended [s]."""
        self._thread.join(timeout)

    def _work(self) -> None:
        while (job := self._next()) is not None:
            try:
                if isinstance(job, _Simulate):
                    self._run(job)
                else:
                    self._keep(job)
            except Exception:
                # Top level of the thread: failures must not end it, and are reported to the user.
                _logger.exception("a run of the dashboard failed")
                self._send(SaveFailed(job.ticket, _INTERNAL_ERROR))

    def _next(self) -> _Simulate | _Save | None:
        """The next task, runs first; None when closed and everything is saved."""
        with self._wake:
            self._wake.wait_for(lambda: self._closed or self._simulation or self._save)
            job: _Simulate | _Save | None = None if self._closed else self._simulation
            if job is not None:
                self._simulation = None
            else:
                job, self._save = self._save, None
            return job

    def _run(self, job: _Simulate) -> None:
        def should_stop() -> bool:
            return self._closed or self._simulation is not None

        try:
            result, elapsed = self._live.simulate(job.scenario, should_stop)
        except ScenarioError as error:
            self._send(RunRefused(job.ticket, error))
            return
        except (MemoryLimitError, ServiceBusyError) as error:
            self._send(SaveFailed(job.ticket, str(error)))
            return
        if result.outcome is not Outcome.STOPPED:
            self._send(RunFinished(job.ticket, result, elapsed))

    def _keep(self, job: _Save) -> None:
        try:
            self._send(RunSaved(job.ticket, self._saved.save(job.result)))
        except (RecordingError, ServiceBusyError) as error:
            self._send(SaveFailed(job.ticket, str(error)))
