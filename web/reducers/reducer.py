"""What every reducer is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.workers.worker import Worker


class Reducer(ABC):
    """One concern of a session: makes a new view of what is asked for.

    A reducer holds threads and clocks; whatever is on the screen is in the view.

    Attributes:
        takes: The intents that it is asked about; several reducers may take the same one.
        workers: Its threads; the session ends them.
    """

    takes: ClassVar[tuple[type[Intent], ...]]
    workers: Sequence[Worker] = ()

    def start(self, view: ViewState) -> ViewState:
        """What it makes of the first view."""
        return view

    @abstractmethod
    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """What it makes of an intent."""

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """What it makes of time that has passed; called at least as often as it asks to be.

        Args:
            now: The monotonic clock [s].
            view: What is on the screen.
        """
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """How soon time must pass for it again [s]; None is whenever something happens."""
        return None

    def expects_answer(self, now: float) -> bool:
        """Whether what it asked for is about to come, so that drawing waits for it.

        Args:
            now: The monotonic clock [s].
        """
        return False
