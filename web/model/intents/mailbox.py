"""Where the intents of a session wait."""

from __future__ import annotations

import queue
from collections.abc import Sequence

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.playback import Seek
from slipgrasp.web.model.intents.scenario import SetParameter


def coalesce(intents: Sequence[Intent]) -> list[Intent]:
    """Drops what a later intent of the same batch makes void, in unchanged order.

    A control that is dragged sends many values; only its last one is worth a simulation.
    """
    kept: list[Intent] = []
    seen: set[object] = set()
    for intent in reversed(intents):
        subject = intent.subject
        if subject in seen:
            continue
        if subject is None:
            seen.clear()  # It builds on what was asked before it.
        else:
            seen.add(subject)
        if isinstance(intent, SetParameter):
            seen.discard(Seek)  # It acts where the play head stands then.
        kept.append(intent)
    return kept[::-1]


class Mailbox:
    """Where the intents of one session wait; anyone may send, one loop receives."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Intent] = queue.SimpleQueue()

    def send(self, intent: Intent) -> None:
        """Puts an intent in and returns at once."""
        self._queue.put(intent)

    def receive(self, timeout: float | None) -> list[Intent]:
        """Everything that is in it, coalesced.

        Args:
            timeout: How long to wait for a first intent [s]; None waits without end.
        """
        intents: list[Intent] = []
        try:
            intents.append(self._queue.get(timeout=timeout))
            while True:
                intents.append(self._queue.get_nowait())
        except queue.Empty:
            return coalesce(intents)
