"""The thread that opens two recordings and compares them."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.web.model.intents.compare import CompareUnreadable, RunsCompared, RunsOpened
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Pair
from slipgrasp.web.workers.open_recordings import OpenRecordings
from slipgrasp.web.workers.worker import QueueWorker


class ComparisonWorker(QueueWorker):
    """Answers the latest request for two recordings, and the latest to compare two runs.

    Args:
        recordings: Opens stored runs.
        send: Takes the answers.
    """

    def __init__(self, recordings: OpenRecordings, send: Send) -> None:
        super().__init__("comparison-worker")
        self._recordings, self._send = recordings, send

    def open(self, number: int, a: str, b: str, instead_of: Collection[Replay] = ()) -> None:
        """Asks for recordings.

        Args:
            number: What the answer is to be recognised by.
            a: Id of the first; empty if only the second is needed.
            b: Id of the second.
            instead_of: What the page will show no more.
        """
        self.ask(partial(self._open, number, a, b, instead_of), "open")

    def compare(self, pair: Pair, a: RunResult, b: RunResult) -> None:
        """Requests the differences between two runs."""
        self.ask(partial(self._compare, pair, a, b), "compare")

    def _open(self, number: int, a: str, b: str, instead_of: Collection[Replay]) -> None:
        def opened(run_id: str) -> Replay:
            return self._recordings.open(run_id, instead_of, self.is_closed)

        try:
            self._send(RunsOpened(number, opened(a) if a else None, opened(b)))
        except SlipgraspError as error:
            self._send(CompareUnreadable(number, str(error)))

    def _compare(self, pair: Pair, a: RunResult, b: RunResult) -> None:
        try:
            with self._recordings.reserve_for(a, b):
                found = compare(a, b)
            self._send(RunsCompared(pair, found))
        except SlipgraspError as error:
            self._send(RunsCompared(pair, None, str(error)))
