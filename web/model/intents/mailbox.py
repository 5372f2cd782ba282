"""Queue of the intents of a session."""

from __future__ import annotations

import queue
from collections.abc import Sequence

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.playback import Seek
from slipgrasp.web.model.intents.scenario import SetParameter


def coalesce(intents: Sequence[Intent]) -> list[Intent]:
    """Removes intents that are superseded by later ones in the batch, without changing the order.

    A dragged control sends many values; only the last one is simulated.
    """
    kept: list[Intent] = []
    seen: set[object] = set()
    for intent in reversed(intents):
        subject = intent.subject
        if subject in seen:
            continue
        if subject is None:
            seen.clear()  # It depends on earlier requests.
        else:
            seen.add(subject)
        if isinstance(intent, SetParameter):
            seen.discard(Seek)  # It acts at the current play head.
        kept.append(intent)
    return kept[::-1]


class Mailbox:
    """Queue of the intents of a session, with many senders and one receiver."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Intent] = queue.SimpleQueue()

    def send(self, intent: Intent) -> None:
        """Adds an intent and returns immediately."""
        self._queue.put(intent)

    def receive(self, timeout: float | None) -> list[Intent]:
        """Returns all waiting intents, coalesced.

        Args:
            timeout: Longest wait for a first intent [s]; None waits indefinitely.
        """
        intents: list[Intent] = []
        try:
            intents.append(self._queue.get(timeout=timeout))
            while True:
                intents.append(self._queue.get_nowait())
        except queue.Empty:
            return coalesce(intents)
