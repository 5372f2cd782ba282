"""All charts of a run as one drawing; imports matplotlib."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from slipgrasp.figures.drawing_thread import in_drawing_thread
from slipgrasp.figures.files import save_figure
from slipgrasp.figures.style import (
    PAGE_WIDTH,
    add_axes,
    add_box,
    add_title,
    new_figure,
    paint,
    paper_style,
)
from slipgrasp.recordings.palette import MARK, SHADE, Rgb
from slipgrasp.web.charts.chart import Line
from slipgrasp.web.charts.drawn import DrawnChart, remarks_on

# Sizes on the page [mm].
_MARGIN = 2.0
_HEADING = 7.0
_REMARK = 4.0
_COLUMNS = 2
_COLUMN = PAGE_WIDTH / _COLUMNS
_LABELS = 15.0
_RIGHT = 3.0
_TITLE = 5.0
_LEGEND_LINE = 4.2
_PER_LEGEND_LINE = 4
_PLOT = 34.0
_TICKS = 10.5

# Axes with smaller numbers only show three significant digits.
_PLAIN = 1e-3
_PALE, _BAND, _SLIPPING = 0.4, 0.12, 0.13
_BROADER = 1.8


@dataclass(frozen=True, slots=True)
class ChartsHeading:
    """Text above the charts of a drawing, and marks in each of them.

    Attributes:
        title: Title of the run.
        ghost: A label of the ghost; empty if there is none.
        time: Time of the play head [s].
        changes: Times of parameter changes [s].
    """

    title: str
    ghost: str
    time: float
    changes: tuple[float, ...]


def charts_svg(charts: Sequence[DrawnChart], heading: ChartsHeading) -> bytes:
    """The charts as an SVG file, drawn in the drawing thread."""
    stream = io.BytesIO()
    in_drawing_thread(lambda: save_figure(draw_charts_figure(charts, heading), stream, "svg"))
    return stream.getvalue()


def draw_charts_figure(charts: Sequence[DrawnChart], heading: ChartsHeading) -> Figure:
    """Draws charts in two columns, with the same lines as on the page.

    Args:
        charts: The charts.
        heading: Text above them.

    Returns:
        The figure; each of its axes is labelled with the key of its chart.
    """
    remarks = [f"Play head at {heading.time:.6g} s.", *remarks_on(charts)]
    if heading.ghost:
        remarks.insert(0, f"Ghost: {heading.ghost}.")
    rows = [charts[i : i + _COLUMNS] for i in range(0, len(charts), _COLUMNS)]
    tops = np.cumsum([_MARGIN + _HEADING, *(_row_height(row) for row in rows)])
    height = float(tops[-1]) + len(remarks) * _REMARK + _MARGIN
    with paper_style():
        figure = new_figure(height)
        _write(figure, heading.title, 2.0, _MARGIN + 0.5 * _HEADING, height, size=10.0)
        for row, top in zip(rows, tops, strict=False):
            for column, chart in enumerate(row):
                _draw_chart(figure, chart, heading, column * _COLUMN, float(top), _legend(row))
        for k, remark in enumerate(remarks):
            _write(figure, remark, 2.0, float(tops[-1]) + (k + 0.5) * _REMARK, height, size=7.0)
    return figure


def _row_height(row: Sequence[DrawnChart]) -> float:
    return _TITLE + _legend(row) + _PLOT + _TICKS


def _legend(row: Sequence[DrawnChart]) -> float:
    """Height of the largest legend of a row [mm]."""
    most = max(len(chart.own.chart.lines) for chart in row)
    return _LEGEND_LINE * -(-most // _PER_LEGEND_LINE)


def _write(
    figure: Figure, text: str, left: float, top: float, height: float, *, size: float
) -> None:
    place = (left / PAGE_WIDTH, 1.0 - top / height)
    figure.text(*place, _printed(text), va="center", fontsize=size)


def _printed(text: str) -> str:
    """Formats letters that the fonts of the figures lack as formulas."""
    symbols = {"$": r"\$", "Fₓ": "$F_x$", "Fₙ": "$F_n$", "Fₜ": "$F_t$", "10⁻³": "$10^{-3}$"}
    for written, typeset in symbols.items():
        text = text.replace(written, typeset)
    return text


def _draw_chart(
    figure: Figure,
    drawn: DrawnChart,
    heading: ChartsHeading,
    left: float,
    top: float,
    legend: float,
) -> None:
    add_title(figure, _printed(drawn.chart.title), left, top, _COLUMN, _TITLE)
    width = _COLUMN - _LABELS - _RIGHT
    axes = add_axes(figure, left + _LABELS, top + _TITLE + legend, width, _PLOT)
    axes.set_label(drawn.chart.key)
    _draw_lines(axes, drawn)
    for change in heading.changes:
        axes.axvline(change, color=paint(MARK), linewidth=0.5, linestyle=(0, (3.0, 2.0)))
    axes.axvline(heading.time, color=paint(MARK), linewidth=0.7)
    axes.set_xlim(drawn.own.window.start, drawn.own.window.end)
    axes.xaxis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))
    low, high = axes.get_ylim()
    if drawn.chart.least > 0.0:
        low, high = min(low, -drawn.chart.least), max(high, drawn.chart.least)
        axes.set_ylim(low, high)
    if max(abs(low), abs(high)) < _PLAIN:
        axes.yaxis.set_major_formatter("{x:.3g}")
    axes.set_xlabel("$t$ [s]", labelpad=1.5)
    axes.set_ylabel("" if drawn.chart.unit == "1" else f"[{_printed(drawn.chart.unit)}]")
    axes.tick_params(top=True, right=True)
    if drawn.own.chart.lines:
        _draw_legend(figure, drawn.own.chart.lines, left, top + _TITLE, legend)


def _draw_lines(axes: Axes, drawn: DrawnChart) -> None:
    times, slipping, *columns = drawn.columns()
    across = axes.get_xaxis_transform()
    axes.fill_between(times, 0.0, slipping, transform=across, **_area(SHADE, _SLIPPING))
    own = drawn.own.chart
    drawn_lines: dict[str, NDArray[np.float64]] = {}
    for line, column, upon in zip(own.lines, columns, drawn.upon, strict=False):
        axes.plot(times, column, **_style(line, len(upon)))
        drawn_lines[line.key] = column
    colours = {line.key: line.colour for line in own.lines}
    for upper, lower in own.bands:
        area = _area(colours[lower], _BAND)
        axes.fill_between(times, drawn_lines[lower], drawn_lines[upper], **area)
    ghost = drawn.ghost.chart.lines if drawn.ghost else ()
    for line, column in zip(ghost, columns[len(own.lines) :], strict=True):
        axes.plot(times, column, alpha=_PALE, **_style(line))


def _area(colour: Rgb, opacity: float) -> dict[str, Any]:
    return {"color": paint(colour), "alpha": opacity, "linewidth": 0.0}


def _style(line: Line, covers: int = 0) -> dict[str, Any]:
    """Style of a line; one that is covered by others is wide, so that it remains visible."""
    colour, broader = paint(line.colour), _BROADER * covers
    if line.dashed:
        return {"color": colour, "linewidth": 0.8 + broader, "linestyle": (0, (4.0, 2.0))}
    return {"color": colour, "linewidth": 1.1 + broader}


def _draw_legend(
    figure: Figure, lines: Sequence[Line], left: float, top: float, legend: float
) -> None:
    box = add_box(figure, left + _LABELS, top, _COLUMN - _LABELS - _RIGHT, legend)
    handles = [Line2D([], [], label=_printed(line.label), **_style(line)) for line in lines]
    box.legend(handles=handles, loc="center left", ncols=_PER_LEGEND_LINE, columnspacing=0.9)
