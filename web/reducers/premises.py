"""The reducer of the assumptions of the paper's theorems, which are computed on request."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from slipgrasp.core.run.premises import describe_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.premises import FindPremises, PremisesFound
from slipgrasp.web.model.view import ShownPremises, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.worker import QueueWorker


class PremisesReducer(Reducer):
    """Computes the assumptions for the run on the screen, and shows them.

    Args:
        send: Accepts the answers of its thread.
    """

    def __init__(self, send: Send) -> None:
        self._send, self._worker = send, QueueWorker("premises-worker")
        self.workers = (self._worker,)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Starts the comparison, or shows its result for the run on the screen."""
        match intent:
            case FindPremises() if view.shown is not None and view.offers_premises:
                find = partial(self._find, view.shown.ticket, view.shown.result)
                self._worker.ask(find, "find")
                return replace(view, premises=ShownPremises(view.shown.ticket))
            case PremisesFound(ticket, sentences) if view.shown and ticket == view.shown.ticket:
                return replace(view, premises=ShownPremises(ticket, sentences))
            case _:
                return view

    def _find(self, ticket: int, result: RunResult) -> None:
        self._send(PremisesFound(ticket, describe_premises(result)))
