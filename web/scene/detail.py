"""How finely an instant is drawn: what nobody can see need not be sent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

_SMALLEST_MOVE = 5e-4


class Detail:
    """What all nodes of a picture are drawn by.

    Attributes:
        least_move: How far something must be from where it is drawn, to be drawn anew [m]: less
            than half a pixel while the play head moves, nothing at all while it rests.
    """

    def __init__(self) -> None:
        self.least_move = 0.0

    def is_far(self, now: Values, drawn: Values) -> NDArray[np.bool_]:
        """What must be drawn anew, along the first axis.

        Args:
            now: Where it should be.
            drawn: Where it is drawn.
        """
        distance = np.abs(now - drawn)
        return distance.reshape(len(distance), -1).max(axis=1) > self.least_move

    def begin_frame(self, *, moving: bool) -> None:
        """Decides about the next frame.

        Args:
            moving: Whether the play head moves.
        """
        self.least_move = _SMALLEST_MOVE if moving else 0.0


class Follower:
    """Keeps one thing of the picture where it should be.

    Args:
        detail: How finely.
        draw: Draws it anew; takes coordinates of any shape.
    """

    def __init__(self, detail: Detail, draw: Callable[[NDArray[np.float64]], None]) -> None:
        self._detail, self._draw = detail, draw
        self._drawn: NDArray[np.float64] | None = None

    def follow(self, coordinates: NDArray[np.float64]) -> None:
        """Draws it anew if it is too far from where it is drawn.

        Args:
            coordinates: Where it should be [m], or angles [rad], of the same shape each time.
        """
        drawn = self._drawn
        if drawn is None or self._detail.is_far(coordinates[None], drawn[None])[0]:
            self._drawn = coordinates.copy()
            self._draw(coordinates)

    def forget(self) -> None:
        """Draws it anew next time, wherever it is."""
        self._drawn = None
