"""Where the lenses go above what the camera looks at, and the words around each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

TITLE_PLACE, SCALE_PLACE, NUMBERS_PLACE = 1.51, 1.2, -1.05
"""How far above its middle the words around a lens stand, in radii; numbers go on downwards."""
TITLE_HEIGHT, SCALE_HEIGHT, NUMBERS_HEIGHT = 0.42, 0.28, 0.33
"""How high they are, in radii: legible where the lens is as small as on a phone."""
NUMBER_LINES = 3
LEADER_PLACE = NUMBERS_PLACE - NUMBER_LINES * NUMBERS_HEIGHT
"""Where the line from a contact ends, in radii: it does not cross the words."""

_ABOVE = TITLE_PLACE + 0.5 * TITLE_HEIGHT + 0.1
_BELOW = -LEADER_PLACE
_MOST_IN_A_ROW = 3
_WIDTH, _SHARE, _LEAST_ASPECT = 0.44, 0.18, 1.1
_MARGIN = 0.3
_MOST_LAG = 4.0  # radii of the object; what is farther off is out of the picture
_DIGITS = 5


class LensPlaces(NamedTuple):
    """Places in the plane of the picture [m].

    Attributes:
        centres: Middle of the lens of each contact, shape ``(contacts, 2)``.
        radius: Radius of every lens.
        low: Lower left corner of lenses and what is below them.
        high: Upper right corner of them.
    """

    centres: Points
    radius: float
    low: Points
    high: Points


def place_lenses(low: Points, high: Points, count: int) -> LensPlaces:
    """Lenses in one row, or in two where there are more than three, above a box.

    Args:
        low: Lower left corner of the box [m].
        high: Its upper right corner.
        count: How many lenses.
    """
    size = high - low
    rows = 1 if count <= _MOST_IN_A_ROW else 2
    columns = -(-count // rows)
    width = max(size[0], _LEAST_ASPECT * size[1])
    radius = min(_WIDTH * width / columns, _SHARE * float(size.max()))
    row, column = np.divmod(np.arange(count), columns)
    in_row = np.where(row < count // columns, columns, count % columns)
    middle = 0.5 * (low[0] + high[0])
    x = middle + width / columns * (column + 0.5 - 0.5 * in_row)
    y = high[1] + radius * (_BELOW + (_ABOVE + _BELOW) * (rows - 1 - row))
    top = high[1] + rows * radius * (_ABOVE + _BELOW)
    half = 0.5 * width
    return LensPlaces(
        centres=np.stack([x, y], axis=1),
        radius=radius,
        low=np.array([middle - half, low[1]]),
        high=np.array([middle + half, top]),
    )


def box_around(corners: Points, path: Points, lag: Points, radius: float) -> tuple[Points, Points]:
    """A box around an object wherever it should be, with a margin for its lag.

    Runs of one desired motion that lag behind it by little have the same.

    Args:
        corners: Its corners at the start, shape ``(corners, 2)`` [m].
        path: Where its centre should be, seen from the start, shape ``(times, 2)`` [m].
        lag: From where it is to there, likewise.
        radius: Farthest corner from its centre.

    Returns:
        Lower left and upper right corner.
    """
    seen = np.isfinite(path).all(axis=1) & np.isfinite(lag).all(axis=1)
    there, behind = path[seen], lag[seen]
    margin = _MARGIN * radius
    below, above = (
        margin + radius * np.where(far > margin, np.ceil(far / radius).clip(max=_MOST_LAG), 0.0)
        for far in _extremes(behind)
    )
    low = corners.min(axis=0) + there.min(axis=0, initial=0.0) - below
    high = corners.max(axis=0) + there.max(axis=0, initial=0.0) + above
    return low.round(_DIGITS), high.round(_DIGITS)


def _extremes(lag: Points) -> tuple[Points, Points]:
    """How far an object is at most short of where it should be, and beyond it, ``(2,)`` each."""
    return lag.max(axis=0, initial=0.0), (-lag).max(axis=0, initial=0.0)
