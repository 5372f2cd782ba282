"""Boxes in the view plane: around the motion of the object, with space for close-ups."""

from __future__ import annotations

import numpy as np

from slipgrasp.scene.rotations import Values

Box = tuple[Values, Values]
"""Lower left and upper right corner [m]."""

_MOST_IN_A_ROW = 3
_RADIUS, _OF_WIDTH, _LEAST_ASPECT = 0.18, 0.44, 1.1
# In radii: the height of a row of close-ups with their captions, and the width of a column.
_ROW, _COLUMN = 3.8, 2.6
_MARGIN = 0.3
_MOST_LAG = 4.0  # radii of the object; larger distances are outside the view
_DIGITS = 5


def with_close_ups(low: Values, high: Values, count: int) -> tuple[Box, Box]:
    """Two boxes with space for close-ups: above, and at both sides for a low view.

    Above they are in two rows if there are more than three.

    Args:
        low: Lower left corner of the box without them [m].
        high: Upper right corner [m].
        count: Number of close-ups.
    """
    size = high - low
    largest = _RADIUS * float(size.max())
    rows = 1 if count <= _MOST_IN_A_ROW else 2
    width = max(size[0], _LEAST_ASPECT * size[1])
    radius = min(_OF_WIDTH * width / -(-count // rows), largest)
    middle, half = 0.5 * (low[0] + high[0]), 0.5 * width
    top = high[1] + rows * _ROW * radius
    in_a_column = -(-count // 2)
    aside = np.array([_COLUMN * largest, 0.5 * max(in_a_column * _ROW * largest - size[1], 0.0)])
    return (
        (np.array([middle - half, low[1]]), np.array([middle + half, top])),
        (low - aside, high + aside),
    )


def box_around(corners: Values, path: Values, lag: Values, radius: float) -> Box:
    """A box around the desired motion of an object, with a margin for its lag.

    Runs with one desired motion and small lags have the same box.

    Args:
        corners: Initial corners, shape ``(corners, 2)`` [m].
        path: Desired positions of its centre, relative to the start, shape ``(times, 2)`` [m].
        lag: Desired minus actual positions, shape ``(times, 2)`` [m].
        radius: Distance of the farthest corner from the centre [m].

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


def _extremes(lag: Values) -> tuple[Values, Values]:
    """Largest lags of an object behind and ahead of its desired position, ``(2,)`` each."""
    return lag.max(axis=0, initial=0.0), (-lag).max(axis=0, initial=0.0)
