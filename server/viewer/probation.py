"""The waiting time of a peer whose viewer was disconnected."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

FAULT_SECONDS = 2.0
"""Additional waiting time of a peer for each disconnected viewer."""

LONGEST_SECONDS = 10.0


class Probation:
    """Delays viewers from peers whose viewers had to be disconnected.

    Starting a session takes a quarter of a second of shared processor time, which a viewer that
    reconnects immediately could use up.

    Args:
        clock: Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._until: dict[str, float] = {}

    def note_fault(self, peer: str) -> None:
        """Records that a viewer was disconnected.

        Args:
            peer: Its address.
        """
        now = self._clock()
        self._until = {one: until for one, until in self._until.items() if until > now}
        longer = max(self._until.get(peer, now), now) + FAULT_SECONDS
        self._until[peer] = min(longer, now + LONGEST_SECONDS)

    def time_left(self, peer: str) -> float:
        """Waiting time of the next viewer of a peer [s]."""
        return max(self._until.get(peer, 0.0) - self._clock(), 0.0)

    async def wait(self, peer: str) -> None:
        """Waits until a viewer of this peer is admitted."""
        while (seconds := self.time_left(peer)) > 0.0:
            await asyncio.sleep(seconds)
