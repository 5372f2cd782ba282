"""The waiting time of a peer whose viewer was disconnected."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

FAULT_SECONDS = 2.0
"""How much longer a peer waits for each viewer that was sent away."""

LONGEST_SECONDS = 10.0


class Probation:
    """Makes viewers wait that come from where others had to be sent away.

    To begin a session takes a quarter of a second of the processor that all share. Who is sent
    away and comes again at once, again and again, would have all of it.

    Args:
        clock: Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._until: dict[str, float] = {}

    def note_fault(self, peer: str) -> None:
        """Notes that a viewer was sent away.

        Args:
            peer: The address from which it came.
        """
        now = self._clock()
        self._until = {one: until for one, until in self._until.items() if until > now}
        longer = max(self._until.get(peer, now), now) + FAULT_SECONDS
        self._until[peer] = min(longer, now + LONGEST_SECONDS)

    def time_left(self, peer: str) -> float:
        """How long the next viewer of a peer has to wait [s]."""
        return max(self._until.get(peer, 0.0) - self._clock(), 0.0)

    async def wait(self, peer: str) -> None:
        """Waits until a viewer of this peer is admitted."""
        while (seconds := self.time_left(peer)) > 0.0:
            await asyncio.sleep(seconds)
