"""How often a session draws while its run plays."""

from __future__ import annotations

import threading
from typing import NamedTuple

FRAME_INTERVAL = 1.0 / 30.0
"""Least time from one frame to the next while the play head moves [s]."""

_DRAWING_SHARE = 0.62
_FORGOTTEN_AFTER = 2.0
_WEIGHT = 0.1


class _Drawing(NamedTuple):
    """What a session's frames cost lately, and when it drew the last one [s]."""

    cost: float
    drawn_at: float


class FramePacer:
    """Lets all sessions that play share the processor: more of them draw less often each.

    Frames are drawn by threads of one interpreter, of which one runs at a time. If together
    they asked for all of it, the loops that send the frames would get none: frames would pile
    up, and every viewer would see the past.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._drawings: dict[int, _Drawing] = {}

    def drew(self, session: int, cost: float, now: float) -> None:
        """Takes note of a frame.

        Args:
            session: Whose.
            cost: How long the processor worked on it [s].
            now: The monotonic clock [s].
        """
        with self._lock:
            known = self._drawings.get(session)
            mean = cost if known is None else known.cost + _WEIGHT * (cost - known.cost)
            self._drawings[session] = _Drawing(mean, now)

    def interval(self, now: float) -> float:
        """Time from one frame of a session to its next [s].

        Args:
            now: The monotonic clock [s]; who has not drawn for a while is forgotten.
        """
        with self._lock:
            self._drawings = {
                session: drawing
                for session, drawing in self._drawings.items()
                if now - drawing.drawn_at < _FORGOTTEN_AFTER
            }
            together = sum(drawing.cost for drawing in self._drawings.values())
        return max(FRAME_INTERVAL, together / _DRAWING_SHARE)
