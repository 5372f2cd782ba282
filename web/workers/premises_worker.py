"""Thread that compares the assumptions of the paper's theorems with a run."""

from __future__ import annotations

from functools import partial

from slipgrasp.core.run.premises import describe_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.premises import PremisesFound
from slipgrasp.web.workers.worker import QueueWorker


class PremisesWorker(QueueWorker):
    """Handles the latest request.

    Args:
        send: Receives the results.
    """

    def __init__(self, send: Send) -> None:
        super().__init__("premises-worker")
        self._send = send

    def find(self, ticket: int, result: RunResult) -> None:
        """Requests the assumptions for a run, which is identified by ``ticket``."""
        self.ask(partial(self._find, ticket, result), "find")

    def _find(self, ticket: int, result: RunResult) -> None:
        self._send(PremisesFound(ticket, describe_premises(result)))
