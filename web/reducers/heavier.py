"""The reducer of the search for the largest mass with which the object is held."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.intents.heavier import AskHowHeavy, HowHeavyFound
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import HowHeavy, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.heavier_worker import HeavierWorker


class HeavierReducer(Reducer):
    """Searches for the largest mass for the draft of the request.

    Args:
        service: Service that simulates.
        send: Accepts the answers.
    """

    def __init__(self, service: RunService, send: Send) -> None:
        self._worker = HeavierWorker(service, send)
        self.workers = (self._worker,)
        self._number = 0

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Starts the search, or shows its result."""
        match intent:
            case AskHowHeavy():
                self._number += 1
                self._worker.find(self._number, view.draft)
                return replace(view, how_heavy=HowHeavy(view.draft, "Trying heavier objects …"))
            case HowHeavyFound(number, words) if number == self._number:
                return replace(view, how_heavy=replace(view.how_heavy, words=words))
            case _:
                return view
