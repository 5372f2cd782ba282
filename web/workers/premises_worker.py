"""The thread that finds what the paper's theorems suppose of a run."""

from __future__ import annotations

from functools import partial

from slipgrasp.core.run.premises import tell_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.premises import PremisesFound
from slipgrasp.web.workers.worker import QueueWorker


class PremisesWorker(QueueWorker):
    """Answers the latest request.

    Args:
        send: Takes the answers.
    """

    def __init__(self, send: Send) -> None:
        super().__init__("premises-worker")
        self._send = send

    def find(self, ticket: int, result: RunResult) -> None:
        """Asks for the premises of a run, which answers to ``ticket``."""
        self.ask(partial(self._find, ticket, result), "find")

    def _find(self, ticket: int, result: RunResult) -> None:
        self._send(PremisesFound(ticket, tell_premises(result)))
