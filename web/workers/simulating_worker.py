"""A thread that simulates for the latest question of a session, and saves nothing."""

from __future__ import annotations

from typing import ClassVar

from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.workers.worker import QueueWorker, Task


class SimulatingWorker(QueueWorker):
    """Gives up an older question for a new one.

    Args:
        service: Simulates.
        send: Takes the answers.

    Attributes:
        name: Name of the thread.
        service: Simulates.
        send: Takes the answers.
    """

    name: ClassVar[str]

    def __init__(self, service: RunService, send: Send) -> None:
        super().__init__(self.name)
        self.service, self.send = service, send
        self._latest = 0

    def ask_latest(self, number: int, task: Task) -> None:
        """Puts a task in the queue for which others are void."""
        self._latest = number
        self.ask(task, "latest")

    def is_void(self, number: int) -> bool:
        """Whether nobody wants the answer to a question any more."""
        return self.is_closed() or number != self._latest
