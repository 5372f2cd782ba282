"""Thread that simulates and stores runs, for a session."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.server.exceptions import MemoryLimitError, ServiceBusyError
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.runs import RunFinished, RunRefused, RunSaved, SaveFailed
from slipgrasp.web.workers.live_runs import LiveRuns
from slipgrasp.web.workers.saved_runs import SavedRuns
from slipgrasp.web.workers.worker import QueueWorker

_INTERNAL_ERROR = "an internal error; see the server's log"

_logger = logging.getLogger(__name__)


class PreviewWorker(QueueWorker):
    """Simulates the latest requested scenario, and stores runs on request.

    Args:
        live: Simulates scenarios.
        saved: Stores runs.
        send: Receives the results.
    """

    def __init__(self, live: LiveRuns, saved: SavedRuns, send: Send) -> None:
        super().__init__("preview")
        self._live, self._saved, self._send = live, saved, send
        self._latest = 0

    def simulate(self, ticket: int, scenario: Scenario) -> None:
        """Requests a run, which replaces an older request."""
        self._latest = ticket
        self.ask(partial(self._answer, ticket, partial(self._run, ticket, scenario)), "run")

    def save(self, ticket: int, result: RunResult) -> None:
        """Requests to store a run; it is stored even if the thread is closed first."""
        task = partial(self._answer, ticket, partial(self._keep, ticket, result))
        self.ask(task, "save", must=True)

    def _answer(self, ticket: int, work: Callable[[], Intent | None]) -> None:
        """Sends the result of a task, or why it failed."""
        answer: Intent | None = SaveFailed(ticket, _INTERNAL_ERROR)
        try:
            answer = work()
        except ScenarioError as error:
            answer = RunRefused(ticket, error)
        except (RecordingError, MemoryLimitError, ServiceBusyError) as error:
            answer = SaveFailed(ticket, str(error))
        except Exception:
            # Top level of the thread: failures must not end it, and are reported to the user.
            _logger.exception("a run of the dashboard failed")
        if answer is not None:
            self._send(answer)

    def _run(self, ticket: int, scenario: Scenario) -> Intent | None:
        """Simulates a scenario; None if it was cancelled."""

        def should_stop() -> bool:
            return self.is_closed() or ticket != self._latest

        result, elapsed = self._live.simulate(scenario, should_stop)
        stopped = result.outcome is Outcome.STOPPED
        return None if stopped else RunFinished(ticket, result, elapsed)

    def _keep(self, ticket: int, result: RunResult) -> Intent:
        return RunSaved(ticket, self._saved.save(result))
