"""The sample that is nearest to each place of a map: what the points between them suggest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

_NONE = -1


def nearest_samples(x: NDArray[np.float64], y: NDArray[np.float64], size: int) -> NDArray[np.intp]:
    """Finds for each cell of a square raster the nearest sample, by jump flooding.

    Each cell is told the samples of cells ever closer to it, 1/2, 1/4, 1/8 … of the raster
    away, and keeps the nearest. The work does not grow with the number of samples.

    Args:
        x: Where the samples stand, 0 … 1 from left to right, shape ``(samples,)``.
        y: The same from bottom to top.
        size: Cells along each side.

    Returns:
        Indices of samples, shape ``(size, size)``, rows from bottom to top.
    """
    nearest = np.full((size, size), _NONE, dtype=np.intp)
    rows, columns = (np.clip((v * size).astype(np.intp), 0, size - 1) for v in (y, x))
    nearest[rows, columns] = np.arange(len(x))
    # Two steps more than halving needs, for the few that it misses.
    for step in [*_halves(size), 2, 1]:
        for along in (-step, 0, step):
            for across in (-step, 0, step):
                _offer(nearest, x, y, along, across)
    return nearest


def _halves(size: int) -> Iterator[int]:
    while size > 1:
        size //= 2
        yield size


def _offer(
    nearest: NDArray[np.intp],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    along: int,
    across: int,
) -> None:
    """Tells each cell the sample of the cell that many rows and columns away."""
    size = len(nearest)
    here = _overlap(along, size), _overlap(across, size)
    there = _overlap(-along, size), _overlap(-across, size)
    own, offered = nearest[here], nearest[there]
    centres = (np.arange(size) + 0.5) / size
    below, left = centres[here[0]][:, None], centres[here[1]][None, :]
    better = _distance(offered, x, y, left, below) < _distance(own, x, y, left, below)
    nearest[here] = np.where(better, offered, own)


def _overlap(shift: int, size: int) -> slice:
    return slice(max(0, -shift), size - max(0, shift))


def _distance(
    samples: NDArray[np.intp],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    left: NDArray[np.float64],
    below: NDArray[np.float64],
) -> NDArray[np.float64]:
    squared = (x[samples] - left) ** 2 + (y[samples] - below) ** 2
    return np.where(samples == _NONE, np.inf, squared)
