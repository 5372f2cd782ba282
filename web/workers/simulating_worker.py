"""Thread that simulates for the latest request of a session, without storing runs."""

from __future__ import annotations

from typing import ClassVar

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.workers.worker import QueueWorker, Task


class SimulatingWorker(QueueWorker):
    """Cancels an older request when a new one arrives.

    Args:
        service: Simulates scenarios.
        send: Receives the results.

    Attributes:
        name: Name of the thread.
        service: Simulates scenarios.
        send: Receives the results.
    """

    name: ClassVar[str]

    def __init__(self, service: RunService, send: Send) -> None:
        super().__init__(self.name)
        self.service, self.send = service, send
        self._latest = 0

    def ask_latest(self, number: int, task: Task) -> None:
        """Adds a task to the queue, and invalidates earlier ones."""
        self._latest = number
        self.ask(task, "latest")

    def is_void(self, number: int) -> bool:
        """True if a request has been superseded or the thread is closing."""
        return self.is_closed() or number != self._latest
