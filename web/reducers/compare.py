"""The reducer of comparisons: a second run as ghost, and the differences."""

from __future__ import annotations

import itertools
from dataclasses import replace

from slipgrasp.web.model.intents.compare import (
    CompareRuns,
    CompareUnreadable,
    EndComparison,
    RunsCompared,
    RunsOpened,
    SwapRuns,
)
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.recordings import OpenRecording
from slipgrasp.web.model.pairing import pair_of, swapped, with_ghost, without_ghost
from slipgrasp.web.model.view import (
    Comparing,
    Pair,
    ViewState,
    replays_of,
    show_replay,
)
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.comparison_worker import ComparisonWorker
from slipgrasp.web.workers.open_recordings import OpenRecordings

_REST = 0.3


class CompareReducer(Reducer):
    """Compares the two runs on the screen after a short pause.

    Args:
        recordings: Opens stored runs.
        send: Accepts the worker's answers.
    """

    def __init__(self, recordings: OpenRecordings, send: Send) -> None:
        self._send = send
        self._worker = ComparisonWorker(recordings, send)
        self.workers = (self._worker,)
        # Tickets of runs count up from zero; these tickets are distinct.
        self._tickets = itertools.count(-1, -1)
        self._seen: Pair | None = None
        self._seen_at = 0.0
        self._asked: Pair | None = None

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Requests two runs, shows them, or shows their differences."""
        match intent:
            case CompareRuns(a, b):
                return self._open(view, a, b) if b else self._open_alone(view, a)
            case EndComparison():
                return without_ghost(view)
            case SwapRuns():
                return swapped(view, next(self._tickets))
            case RunsOpened(number, a, b) if number == view.opening:
                view = view if a is None else show_replay(view, a)
                return with_ghost(view, b, next(self._tickets))
            case CompareUnreadable(number, message) if number == view.opening:
                return replace(view, comparing=replace(view.comparing, message=message))
            case RunsCompared(pair, findings, message, distances) if pair == pair_of(view):
                return replace(view, comparing=Comparing(pair, findings, message, distances))
            case _:
                return view

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Starts the comparison of a new pair, unless a run is still being changed."""
        pair = pair_of(view)
        if pair != self._seen:
            self._seen, self._seen_at = pair, now
        elif self._is_due(pair) and now - self._seen_at >= _REST:
            self._ask(pair, view)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until a new pair is compared."""
        pair = pair_of(view)
        if not self._is_due(pair):
            return None
        since = now - self._seen_at if pair == self._seen else 0.0
        return max(_REST - since, 0.0)

    def _is_due(self, pair: Pair | None) -> bool:
        return pair is not None and pair != self._asked

    def _ask(self, pair: Pair | None, view: ViewState) -> None:
        assert pair is not None and view.shown is not None and view.ghost is not None
        self._asked = pair
        pale = view.ghost.shown
        measured = pale.replay.measured if pale.replay is not None else None
        self._worker.compare(pair, view.shown.result, measured or pale.result)

    def _open_alone(self, view: ViewState, a: str) -> ViewState:
        """Shows one run without a ghost."""
        if a and not _is_shown(a, view):
            self._send(OpenRecording(a))
        return without_ghost(view)

    def _open(self, view: ViewState, a: str, b: str) -> ViewState:
        number = view.opening + 1
        keeps_a = not a or _is_shown(a, view)
        # The run on the screen and its recording are unchanged.
        kept = () if not keeps_a or view.shown is None else (view.shown.replay, view.replay)
        instead_of = [replay for replay in replays_of(view) if replay not in kept]
        run = view.shown.result if view.shown is not None else None
        self._worker.open(number, "" if keeps_a else a, b, run, instead_of)
        return replace(view, opening=number)


def _is_shown(run_id: str, view: ViewState) -> bool:
    replay = view.shown.replay if view.shown else None
    return replay is not None and run_id == replay.run_id
