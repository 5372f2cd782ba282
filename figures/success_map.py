"""Map of the outcomes of a study over two of its varied parameters."""

from __future__ import annotations

import math
import re
import textwrap
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.knowledge import describe_knowledge_in
from slipgrasp.figures.map_data import MapAxis, map_axis, panels_of
from slipgrasp.figures.map_key import BASE_MARK, EQUAL_LINE, KEY_LINE, draw_key, key_lines
from slipgrasp.figures.map_labels import axis_label, panel_title, projection_note, same_quantity
from slipgrasp.figures.map_marks import draw_runs, has_cells
from slipgrasp.figures.style import PAGE_WIDTH, add_axes, new_figure, paper_style
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.results import StudyResults

# Sizes on the page [mm].
_MARGIN = 2.0
_HEADING = 7.0
_TITLE = 6.0
_LABELS = 15.0
_RIGHT = 3.0
_TICKS = 11.0
_GAP = 3.0
_NOTE = 4.5
_WIDEST = 84.0
_KEY_BESIDE = 72.0
_COLUMNS = 2

_LONGEST_NOTE = 120


class _Place(NamedTuple):
    """Position of a panel on the page [mm]."""

    left: float
    top: float
    size: float


def draw_success_map(results: StudyResults, x: str, y: str) -> Figure:
    """Draws the outcomes of a study over two varied parameters.

    Grids are cells. Samples are points, and the background has the paler colour of the nearest
    sample. A line bounds the region where the object is held; the key shows the number of runs in
    each category. Values that are crossed with both parameters become panels.

    The text below describes the known and unknown parameters of the controllers.

    In an SVG each cell and point is a link to ``#run-INDEX``.

    Args:
        results: The results so far.
        x: The key along the horizontal axis.
        y: The key along the vertical axis.

    Returns:
        The figure; its panels are labelled ``a``, ``b`` …

    Raises:
        QueryError: If one of them does not vary, or is not numeric, or both are the same.
    """
    if x == y:
        raise QueryError(y, f"a map needs two parameters, not '{y[:80]}' twice")
    across, up = map_axis(results, x), map_axis(results, y)
    panels = panels_of(results, x, y)
    lines = key_lines(panels, across, up, results.study.base.space)
    notes = _notes(results.study, (x, y, *panels[0].values))
    with paper_style():
        height, places = _layout(len(panels), len(lines), bool(results.study.title), len(notes))
        figure = new_figure(height)
        _write_heading(figure, results.study.title, height)
        for letter, panel, place in zip(ascii_lowercase, panels, places, strict=False):
            axes = _add_panel(figure, letter, place)
            draw_runs(axes, panel, across, up)
            _finish(axes, results, across, up)
            if len(panels) > 1 or panel.values:
                _write_title(
                    figure, f"({letter}) {panel_title(results.study, panel.values)}", place
                )
            beside = _place_of_key(place, alone=len(panels) == 1)
            draw_key(figure, lines, panel, beside, has_points=not has_cells(across, up))
        for k, note in enumerate(reversed(notes)):
            _write(figure, note, 0.5 * PAGE_WIDTH, height - _MARGIN - (k + 0.5) * _NOTE, height)
    return figure


def _notes(study: Study, shown: tuple[str, ...]) -> list[str]:
    """Known parameters of the controllers, and other varied parameters, in lines of page width."""
    known = re.split(r"(?<=\.) ", describe_knowledge_in(study))
    lines = [line for sentence in known for line in textwrap.wrap(sentence, _LONGEST_NOTE)]
    return [*lines, *filter(None, [projection_note(study, shown)])]


def _layout(
    num_panels: int, num_lines: int, has_heading: bool, num_notes: int
) -> tuple[float, list[_Place]]:
    """Height of the page, and positions of its panels."""
    columns = min(num_panels, _COLUMNS)
    alone = num_panels == 1
    available = PAGE_WIDTH / columns - _LABELS - _RIGHT
    size = min(available, _WIDEST)
    top = _MARGIN + (_HEADING if has_heading else 0.0)
    title = 0.0 if alone else _TITLE
    key = 0.0 if alone else KEY_LINE * num_lines + _GAP
    row = title + size + _TICKS + key
    left = 0.5 * (PAGE_WIDTH - (_LABELS + size + _GAP + _KEY_BESIDE)) if alone else 0.0
    places = [
        _Place(
            left + (k % columns) * PAGE_WIDTH / columns + _LABELS,
            top + (k // columns) * row + title,
            size,
        )
        for k in range(num_panels)
    ]
    num_rows = math.ceil(num_panels / columns)
    return top + num_rows * row + _NOTE * num_notes + _MARGIN, places


def _place_of_key(place: _Place, *, alone: bool) -> tuple[float, float, float]:
    """Left, top and width of the key of a panel [mm]: next to it, or below it."""
    if alone:
        return place.left + place.size + _GAP, place.top, _KEY_BESIDE
    return place.left, place.top + place.size + _TICKS, place.size


def _write_heading(figure: Figure, title: str, height: float) -> None:
    if title:
        shown = title.replace("$", r"\$")
        _write(figure, shown, 0.5 * PAGE_WIDTH, _MARGIN + 0.4 * _HEADING, height, size=10.0)


def _write_title(figure: Figure, text: str, place: _Place) -> None:
    height = figure.get_figheight() * 25.4
    _write(figure, text, place.left + 0.5 * place.size, place.top - 0.5 * _TITLE, height, size=9.5)


def _write(
    figure: Figure, text: str, left: float, top: float, height: float, *, size: float = 8.0
) -> None:
    figure.text(
        left / PAGE_WIDTH, 1.0 - top / height, text, ha="center", va="center", fontsize=size
    )


def _add_panel(figure: Figure, letter: str, place: _Place) -> Axes:
    axes = add_axes(figure, place.left, place.top, place.size, place.size)
    axes.set_label(letter)
    return axes


def _finish(axes: Axes, results: StudyResults, x: MapAxis, y: MapAxis) -> None:
    """Scales, labels, the line of equal values, and the point of the base."""
    for axis, own, scale, limits, label in (
        (x, axes.xaxis, axes.set_xscale, axes.set_xlim, axes.set_xlabel),
        (y, axes.yaxis, axes.set_yscale, axes.set_ylim, axes.set_ylabel),
    ):
        scale("log" if axis.is_log else "linear")
        limits(axis.low, axis.high)
        label(axis_label(results.study, axis.key), labelpad=2.0)
        if axis.is_log:
            own.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
            own.set_major_formatter("{x:g}")
            own.set_minor_formatter(NullFormatter())
        else:
            own.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axes.tick_params(top=True, right=True, which="both")
    if same_quantity(x.key, y.key):
        _draw_diagonal(axes, x, y)
    if x.base is not None and y.base is not None:
        axes.plot(x.base, y.base, gid="base", zorder=5.0, **BASE_MARK)


def _draw_diagonal(axes: Axes, x: MapAxis, y: MapAxis) -> None:
    low, high = max(x.low, y.low), min(x.high, y.high)
    if low < high:
        ends = np.array([low, high])
        line = axes.plot(ends, ends, gid="equal", zorder=4.0, **EQUAL_LINE)[0]
        line.set_path_effects([withStroke(linewidth=1.8, foreground="white", alpha=0.7)])
