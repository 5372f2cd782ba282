"""The thread that opens two recordings and finds out what tells two runs apart."""

from __future__ import annotations

from functools import partial

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.compare.comparison import IncomparableError, compare
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.model.intents.compare import CompareUnreadable, RunsCompared, RunsOpened
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.replay import open_replay
from slipgrasp.web.model.view import Pair
from slipgrasp.web.workers.worker import QueueWorker


class ComparisonWorker(QueueWorker):
    """Answers the latest request for two recordings, and the latest to compare two runs.

    Args:
        store: The stored runs.
        send: Takes the answers.
    """

    def __init__(self, store: RecordingStore, send: Send) -> None:
        super().__init__("comparison-worker")
        self._store, self._send = store, send

    def open(self, number: int, a: str, b: str) -> None:
        """Asks for recordings.

        Args:
            number: What the answer is to be recognised by.
            a: Id of the first; empty if only the second is needed.
            b: Id of the second.
        """
        self.ask(partial(self._open, number, a, b), "open")

    def compare(self, pair: Pair, a: RunResult, b: RunResult) -> None:
        """Asks what tells two runs apart."""
        self.ask(partial(self._compare, pair, a, b), "compare")

    def _open(self, number: int, a: str, b: str) -> None:
        try:
            first = open_replay(self._store, a) if a else None
            self._send(RunsOpened(number, first, open_replay(self._store, b)))
        except RecordingError as error:
            self._send(CompareUnreadable(number, str(error)))

    def _compare(self, pair: Pair, a: RunResult, b: RunResult) -> None:
        try:
            self._send(RunsCompared(pair, compare(a, b)))
        except IncomparableError as error:
            self._send(RunsCompared(pair, None, str(error)))
