"""Frame rate of a session during playback."""

from __future__ import annotations

import threading
from typing import NamedTuple

FRAME_INTERVAL = 1.0 / 30.0
"""Smallest interval between frames while the play head moves [s]."""

_DRAWING_SHARE = 0.62
_FORGOTTEN_AFTER = 2.0
_WEIGHT = 0.1


class _Drawing(NamedTuple):
    """Recent cost of a session's frames, and time of the last one [s]."""

    cost: float
    drawn_at: float


class FramePacer:
    """Shares the processor among all playing sessions: with more sessions each draws less often.

    Frames are drawn by threads of one interpreter, of which one runs at a time. If they used all of
    its time, the loops that send the frames would get none: frames would accumulate, and viewers
    would see old ones.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._drawings: dict[int, _Drawing] = {}

    def drew(self, session: int, cost: float, now: float) -> None:
        """Records a frame.

        Args:
            session: The session.
            cost: Processor time of the frame [s].
            now: The monotonic clock [s].
        """
        with self._lock:
            known = self._drawings.get(session)
            mean = cost if known is None else known.cost + _WEIGHT * (cost - known.cost)
            self._drawings[session] = _Drawing(mean, now)

    def interval(self, now: float) -> float:
        """Interval between frames of a session [s].

        Args:
            now: The monotonic clock [s]; sessions that have not drawn for a while are ignored.
        """
        with self._lock:
            self._drawings = {
                session: drawing
                for session, drawing in self._drawings.items()
                if now - drawing.drawn_at < _FORGOTTEN_AFTER
            }
            together = sum(drawing.cost for drawing in self._drawings.values())
        return max(FRAME_INTERVAL, together / _DRAWING_SHARE)
