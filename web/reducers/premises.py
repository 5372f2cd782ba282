"""The reducer of the assumptions of the paper's theorems, which are computed on request."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.premises import FindPremises, PremisesFound
from slipgrasp.web.model.view import ShownPremises, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.premises_worker import PremisesWorker


class PremisesReducer(Reducer):
    """Computes the assumptions for the run on the screen, and shows them.

    Args:
        send: Accepts the worker's answers.
    """

    def __init__(self, send: Send) -> None:
        self._worker = PremisesWorker(send)
        self.workers = (self._worker,)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Starts the worker, or shows its result for the run on the screen."""
        match intent:
            case FindPremises() if view.shown is not None and view.offers_premises:
                self._worker.find(view.shown.ticket, view.shown.result)
                return replace(view, premises=ShownPremises(view.shown.ticket))
            case PremisesFound(ticket, sentences) if view.shown and ticket == view.shown.ticket:
                return replace(view, premises=ShownPremises(ticket, sentences))
            case _:
                return view
