"""Interface of reducers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.workers.worker import QueueWorker


class Reducer(ABC):
    """A reducer: creates a new view from intents for one concern of a session.

    A reducer has threads and clocks; everything on the screen is in the view.

    Attributes:
        workers: Its threads, which the session ends.
    """

    workers: Sequence[QueueWorker] = ()

    def start(self, view: ViewState) -> ViewState:
        """Returns the initial view."""
        return view

    @abstractmethod
    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Handles an intent; returns the same view if it belongs to other reducers."""

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Handles the passing of time; called at least as often as requested.

        Args:
            now: The monotonic clock [s].
            view: The screen.
        """
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until its next tick [s]; None if it only handles intents."""
        return None

    def expects_answer(self, now: float) -> bool:
        """Whether a requested result is about to arrive, so that drawing waits for it.

        Args:
            now: The monotonic clock [s].
        """
        return False
