"""Draws the map of a study for the page, as SVG with clickable runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from html import escape

import numpy as np
from numpy.typing import NDArray

from slipgrasp.figures.map_data import (
    NOTHING,
    Cells,
    MapAxis,
    MapPanel,
    cells_of,
    map_axis,
    panels_of,
)
from slipgrasp.recordings.study.categories import (
    CATEGORIES,
    HELD,
    categorize,
    category_words,
)
from slipgrasp.recordings.study.map_axes import choose_axes, numeric_keys
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.web.model.intents.study import OpenStudyRun
from slipgrasp.web.model.parameter_names import ParameterNames, names_of
from slipgrasp.web.model.study_map import SIZE, MapPanelPicture, MapPicture
from slipgrasp.web.model.study_words import value_words
from slipgrasp.web.page.markup import click_attribute

MOST_CELLS = 2500
"""More cells could not be distinguished or clicked, and would slow the page down."""
MOST_POINTS = 1500

_RADIUS = 9


def draw_map(results: StudyResults) -> MapPicture | None:
    """The current map of a study; None if no two numeric parameters vary.

    Args:
        results: The results; they may grow meanwhile.
    """
    shown = results.first(results.num_rows)
    keys = choose_axes(shown.study) or numeric_keys(shown.study)[:2]
    if len(keys) < 2:
        return None
    x, y = map_axis(shown, keys[0]), map_axis(shown, keys[1])
    panels = panels_of(shown, *keys)
    lumped = _lumped(x, y, len(panels))
    x, y = _coarser(x, lumped), _coarser(y, lumped)
    names = names_of(shown.study.base)
    told = _Telling(shown, keys, names)
    counts = np.bincount(categorize(shown), minlength=len(CATEGORIES))
    crossed = {key for panel in panels for key in panel.values}
    return MapPicture(
        study=shown.study,
        across=x,
        up=y,
        labels=(names.label(x.key), names.label(y.key)),
        panels=tuple(_panel_picture(told, panel, x, y) for panel in panels),
        counts={way: int(count) for way, count in enumerate(counts) if count or way == HELD},
        lumped=lumped,
        note=_note(names, [key for key in shown.study.keys if key not in {*keys, *crossed}]),
    )


def _lumped(x: MapAxis, y: MapAxis, num_panels: int) -> int:
    """Number of cells along each side that are merged, to limit their number."""
    if x.edges is None or y.edges is None:
        return 1
    columns, rows, step = len(x.edges) - 1, len(y.edges) - 1, 1
    while math.ceil(columns / step) * math.ceil(rows / step) * num_panels > MOST_CELLS:
        step += 1
    return step


def _coarser(axis: MapAxis, step: int) -> MapAxis:
    if axis.edges is None or step == 1:
        return axis
    return replace(axis, edges=np.unique([*axis.edges[::step], axis.edges[-1]]))


def _note(names: ParameterNames, hidden: list[str]) -> str:
    return f"Not distinguished here: {', '.join(map(names.words, hidden))}." if hidden else ""


class _Telling:
    """Describes the values and the outcome of a run on one line.

    Args:
        results: The results, which are complete.
        keys: Keys of the axes.
        names: Names of the parameters.
    """

    def __init__(self, results: StudyResults, keys: tuple[str, ...], names: ParameterNames) -> None:
        self.names, self._space = names, results.study.base.space
        self._columns = [(names.words(key), names.unit(key), results.values(key)) for key in keys]
        self._ends = results.numbers("end_time")
        paths = [f"slip_path_{finger}" for finger in range(len(results.study.base.fingers))]
        self._slips = np.array([results.numbers(path) for path in paths]).max(axis=0)

    def line(self, index: int, way: int) -> str:
        """The description of a run with a given outcome."""
        values = ", ".join(
            f"{words} {value_words(column[index], unit)}" for words, unit, column in self._columns
        )
        slip, end = self._slips[index], self._ends[index]
        slipped = "" if math.isnan(slip) else f", slip {1e3 * slip:.3g} mm"
        ended = "" if way == HELD or math.isnan(end) else f" at {end:.3g} s"
        return f"run {index}: {values}. {category_words(way, self._space)}{ended}{slipped}"


def _panel_picture(told: _Telling, panel: MapPanel, x: MapAxis, y: MapAxis) -> MapPanelPicture:
    names = told.names
    title = ", ".join(
        f"{names.words(key)} = {value_words(value, names.unit(key))}"
        for key, value in panel.values.items()
    )
    if x.edges is not None and y.edges is not None:
        marks = "".join(_cell_marks(told, cells_of(panel, x, y), x, y))
    else:
        marks = "".join(_point_marks(told, panel, x, y))
    held = int(panel.counts[HELD])
    return MapPanelPicture(panel.values, title, marks, len(panel.runs), held)


def _cell_marks(told: _Telling, cells: Cells, x: MapAxis, y: MapAxis) -> Iterator[str]:
    assert x.edges is not None and y.edges is not None
    across = _at(x.share(x.edges))
    up = _at(1.0 - y.share(y.edges))
    for way in np.unique(cells.categories).tolist():
        if way == NOTHING:
            continue
        yield f"<g class='sg-cells' fill='url(#sg-way-{way})'>"
        for column, row in zip(*np.nonzero(cells.categories == way), strict=True):
            left, right, top, bottom = across[column], across[column + 1], up[row + 1], up[row]
            box = f"x='{left}' y='{top}' width='{right - left}' height='{bottom - top}'"
            yield _mark("rect", box, told, int(cells.runs[column, row]), way)
        yield "</g>"
    is_there = cells.categories != NOTHING
    yield _boundary(cells.held & is_there, is_there, across, up)


def _point_marks(told: _Telling, panel: MapPanel, x: MapAxis, y: MapAxis) -> Iterator[str]:
    shown = slice(0, MOST_POINTS)
    across, up = _at(x.share(panel.x[shown])), _at(1.0 - y.share(panel.y[shown]))
    runs, ways = panel.runs[shown].tolist(), panel.categories[shown].tolist()
    for left, top, run, way in zip(across, up, runs, ways, strict=True):
        place = f"cx='{left}' cy='{top}' r='{_RADIUS}' fill='url(#sg-way-{way})'"
        yield _mark("circle", place, told, run, way)


def _mark(shape: str, place: str, told: _Telling, run: int, way: int) -> str:
    attribute = click_attribute(OpenStudyRun(run))
    line = escape(told.line(run, way))
    return f"<{shape} {place} {attribute}><title>{line}</title></{shape}>"


def _boundary(
    held: NDArray[np.bool_], known: NDArray[np.bool_], across: list[int], up: list[int]
) -> str:
    """The boundary between held cells and other neighbours with results."""
    upright = (held[1:] != held[:-1]) & known[1:] & known[:-1]
    level = (held[:, 1:] != held[:, :-1]) & known[:, 1:] & known[:, :-1]
    steps = [
        f"M{across[column + 1]} {up[row]}V{up[row + 1]}"
        for column, row in zip(*np.nonzero(upright), strict=True)
    ]
    steps += [
        f"M{across[column]} {up[row + 1]}H{across[column + 1]}"
        for column, row in zip(*np.nonzero(level), strict=True)
    ]
    return f"<path class='sg-map-over sg-map-boundary' d='{''.join(steps)}'/>" if steps else ""


def _at(shares: NDArray[np.float64]) -> list[int]:
    """Converts fractions to integer positions, so that neighbours meet."""
    return np.rint(SIZE * shares).astype(int).tolist()
