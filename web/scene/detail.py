"""Level of detail: invisible changes are not sent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from slipgrasp.scene.rotations import Values

_SMALLEST_MOVE = 5e-4


class Detail:
    """Common level of detail of all nodes of a view.

    Attributes:
        least_move: Smallest displacement that is drawn [m]: less than half a pixel while the play
            head moves, zero while it rests.
    """

    def __init__(self) -> None:
        self.least_move = 0.0

    def is_far(self, now: Values, drawn: Values) -> NDArray[np.bool_]:
        """Mask of the rows that must be drawn again.

        Args:
            now: New positions.
            drawn: Drawn positions.
        """
        distance = np.abs(now - drawn)
        return distance.reshape(len(distance), -1).max(axis=1) > self.least_move

    def begin_frame(self, *, moving: bool) -> None:
        """Sets the level for the next frame.

        Args:
            moving: Whether the play head moves.
        """
        self.least_move = _SMALLEST_MOVE if moving else 0.0


class Follower:
    """Keeps one element of the view up to date.

    Args:
        detail: Level of detail.
        draw: Draws it; accepts coordinates of any shape.
    """

    def __init__(self, detail: Detail, draw: Callable[[NDArray[np.float64]], None]) -> None:
        self._detail, self._draw = detail, draw
        self._drawn: NDArray[np.float64] | None = None

    def follow(self, coordinates: NDArray[np.float64]) -> None:
        """Draws it again if it has moved visibly.

        Args:
            coordinates: New coordinates [m] or angles [rad], always of the same shape.
        """
        drawn = self._drawn
        if drawn is None or self._detail.is_far(coordinates[None], drawn[None])[0]:
            self._drawn = coordinates.copy()
            self._draw(coordinates)

    def forget(self) -> None:
        """Draws it again at the next update in any case."""
        self._drawn = None
