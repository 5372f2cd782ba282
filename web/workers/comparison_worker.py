"""Thread that opens two recordings and compares them."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.compare.measured import measure_distances
from slipgrasp.recordings.measured.recording import MeasuredRecording
from slipgrasp.web.model.intents.compare import CompareUnreadable, RunsCompared, RunsOpened
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Pair
from slipgrasp.web.workers.open_recordings import OpenRecordings
from slipgrasp.web.workers.worker import QueueWorker


class ComparisonWorker(QueueWorker):
    """Handles the latest request to open two recordings, and the latest to compare two runs.

    Args:
        recordings: Opens stored runs.
        send: Receives the results.
    """

    def __init__(self, recordings: OpenRecordings, send: Send) -> None:
        super().__init__("comparison-worker")
        self._recordings, self._send = recordings, send

    def open(
        self,
        number: int,
        a: str,
        b: str,
        run: RunResult | None = None,
        instead_of: Collection[Replay] = (),
    ) -> None:
        """Requests two recordings.

        Args:
            number: Number of the request, repeated in the result.
            a: Id of the first recording; empty if only the second is needed.
            b: Id of the second recording; measured data are overlaid on the first.
            run: The displayed run, which is the first if ``a`` is empty.
            instead_of: Replays that the page will no longer display.
        """
        self.ask(partial(self._open, number, a, b, run, instead_of), "open")

    def compare(self, pair: Pair, a: RunResult, b: RunResult | MeasuredRecording) -> None:
        """Requests the differences between two runs, or of measured data from a run."""
        self.ask(partial(self._compare, pair, a, b), "compare")

    def _open(
        self, number: int, a: str, b: str, run: RunResult | None, instead_of: Collection[Replay]
    ) -> None:
        def opened(run_id: str, below: RunResult | None = None) -> Replay:
            return self._recordings.open(run_id, instead_of, self.is_closed, below)

        try:
            first = opened(a) if a else None
            below = run if first is None else first.result
            self._send(RunsOpened(number, first, opened(b, below)))
        except SlipgraspError as error:
            self._send(CompareUnreadable(number, str(error)))

    def _compare(self, pair: Pair, a: RunResult, b: RunResult | MeasuredRecording) -> None:
        try:
            if isinstance(b, MeasuredRecording):
                self._send(RunsCompared(pair, None, distances=measure_distances(b, a)))
                return
            with self._recordings.reserve_for(a, b):
                found = compare(a, b)
            self._send(RunsCompared(pair, found))
        except SlipgraspError as error:
            self._send(RunsCompared(pair, None, str(error)))
