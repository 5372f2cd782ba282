"""Runs on a map: cells or points in the colours of their outcomes, and the boundary."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from slipgrasp.figures.category_style import colour_of, hatch_of, marker_of
from slipgrasp.figures.map_data import NOTHING, Cells, MapAxis, MapPanel, cells_of
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import MARK
from slipgrasp.recordings.study.categories import CATEGORIES, HELD

_MOST_POINTS = 4000
"""Largest number of points, to avoid overlap; the others still colour the background."""
_RASTER = 256
_PALE = 0.62
_BOUNDARY = 1.1
_OF_A_CELL = 0.2
"""Largest number of cells with outlines, which would otherwise hide them."""


def run_link(index: int) -> str:
    """Target of the link of a run in an SVG."""
    return f"#run-{index}"


def has_cells(x: MapAxis, y: MapAxis) -> bool:
    """Whether the runs are in cells."""
    return x.edges is not None and y.edges is not None


def draw_runs(axes: Axes, panel: MapPanel, x: MapAxis, y: MapAxis) -> None:
    """Draws the runs of a panel, each as a link, and the boundary of held runs."""
    if x.edges is not None and y.edges is not None:
        cells = cells_of(panel, x, y)
        _draw_cells(axes, cells, x.edges, y.edges)
        _draw_boundary(axes, cells.held, x.edges, y.edges)
    elif len(panel.runs):
        _draw_ground(axes, panel, x, y)
        _draw_points(axes, panel)


def _draw_cells(axes: Axes, cells: Cells, x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
    """Draws each cell as a link to its run, and the hatches of failures."""
    columns, rows = np.nonzero(cells.categories != NOTHING)
    faces = [paint(colour_of(category)) for category in cells.categories[columns, rows].tolist()]
    fill = PolyCollection(
        [*_rectangles(x[columns], x[columns + 1], y[rows], y[rows + 1])],
        facecolors=faces,
        edgecolors=faces,
        linewidths=0.25,
        urls=[run_link(run) for run in cells.runs[columns, rows].tolist()],
        gid="runs",
        zorder=1.0,
    )
    axes.add_collection(fill, autolim=False)
    for category in np.unique(cells.categories).tolist():
        if category != NOTHING and hatch_of(category):
            _hatch(axes, _strips(cells.categories == category, x, y), category)


def _strips(
    chosen: NDArray[np.bool_], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Selected cells as rectangles, with neighbours in a column merged."""
    changes = np.diff(np.pad(chosen, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    columns, starts = np.nonzero(changes == 1)
    _, ends = np.nonzero(changes == -1)
    return _rectangles(x[columns], x[columns + 1], y[starts], y[ends])


def _rectangles(
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Corners, shape ``(rectangles, 4, 2)``."""
    corners = [(left, low), (right, low), (right, high), (left, high)]
    return np.stack([np.stack(corner, axis=1) for corner in corners], axis=1)


def _hatch(axes: Axes, rectangles: NDArray[np.float64], category: int, share: float = 0.45) -> None:
    hatches = PolyCollection(
        [*rectangles],
        facecolors="none",
        edgecolors=[paint(lighter(MARK, share))],
        linewidths=0.0,
        hatch=hatch_of(category),
        zorder=1.5,
    )
    axes.add_collection(hatches, autolim=False)


def _draw_boundary(
    axes: Axes, held: NDArray[np.bool_], x: NDArray[np.float64], y: NDArray[np.float64]
) -> None:
    """Lines between held cells and other neighbours."""
    columns, rows = np.nonzero(held[1:] != held[:-1])
    upright = np.stack(
        [
            np.stack([x[columns + 1], y[rows]], axis=1),
            np.stack([x[columns + 1], y[rows + 1]], axis=1),
        ],
        axis=1,
    )
    columns, rows = np.nonzero(held[:, 1:] != held[:, :-1])
    level = np.stack(
        [
            np.stack([x[columns], y[rows + 1]], axis=1),
            np.stack([x[columns + 1], y[rows + 1]], axis=1),
        ],
        axis=1,
    )
    lines = LineCollection(
        [*upright, *level],
        colors=[paint(MARK)],
        linewidths=min(_BOUNDARY, _OF_A_CELL * _points_per_cell(axes, held)),
        capstyle="projecting",
        gid="boundary",
        zorder=3.0,
    )
    axes.add_collection(lines, autolim=False)


def _points_per_cell(axes: Axes, cells: NDArray[np.bool_]) -> float:
    """Width of a cell on the page [1/72 inch]."""
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return 72.0 * figure.get_figwidth() * axes.get_position().width / max(cells.shape)


def _draw_ground(axes: Axes, panel: MapPanel, x: MapAxis, y: MapAxis) -> None:
    """Background in the pale colour of the nearest sample, and boundary of held samples."""
    nearest = nearest_samples(x.share(panel.x), y.share(panel.y), _RASTER)
    categories = panel.categories[nearest]
    colours = np.array([lighter(colour_of(category), _PALE) for category in range(len(CATEGORIES))])
    axes.imshow(
        colours[categories].astype(np.uint8),
        origin="lower",
        extent=(0.0, 1.0, 0.0, 1.0),
        transform=axes.transAxes,
        interpolation="nearest",
        aspect="auto",
        zorder=0.5,
    )
    held = categories == HELD
    if held.any() and not held.all():
        centres = (np.arange(_RASTER) + 0.5) / _RASTER
        axes.contour(
            centres,
            centres,
            held.astype(float),
            levels=[0.5],
            colors=[paint(MARK)],
            linewidths=_BOUNDARY,
            transform=axes.transAxes,
            zorder=3.0,
        )


def _draw_points(axes: Axes, panel: MapPanel) -> None:
    shown = slice(0, _MOST_POINTS)
    runs, categories = panel.runs[shown], panel.categories[shown]
    size = float(np.clip(900.0 / max(len(runs), 1), 5.0, 22.0))
    for category in np.unique(categories).tolist():
        chosen = categories == category
        axes.scatter(
            panel.x[shown][chosen],
            panel.y[shown][chosen],
            s=size,
            marker=marker_of(category),
            color=[paint(colour_of(category))],
            edgecolors=[paint(MARK)],
            linewidths=0.35,
            urls=[run_link(run) for run in runs[chosen].tolist()],
            gid=f"runs {category}",
            clip_on=False,
            zorder=2.5,
        )


_NONE = -1


def nearest_samples(x: NDArray[np.float64], y: NDArray[np.float64], size: int) -> NDArray[np.intp]:
    """Finds the nearest sample for each cell of a square raster, by jump flooding.

    Each cell receives the samples of cells at decreasing distances, 1/2, 1/4, 1/8 … of the raster,
    and keeps the nearest one. The cost does not depend on the number of samples.

    Args:
        x: Horizontal positions of the samples, 0 … 1 from left to right, shape ``(samples,)``.
        y: Vertical positions, from bottom to top, shape ``(samples,)``.
        size: Number of cells along each side.

    Returns:
        Indices of samples, shape ``(size, size)``, rows from bottom to top.
    """
    nearest = np.full((size, size), _NONE, dtype=np.intp)
    rows, columns = (np.clip((v * size).astype(np.intp), 0, size - 1) for v in (y, x))
    nearest[rows, columns] = np.arange(len(x))
    # Two additional steps correct the few cells that halving misses.
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
    """Offers each cell the sample of the cell at a given offset of rows and columns."""
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
