"""A chart on the page: title, legend and lines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from slipgrasp.recordings.palette import SHADE
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.charts.drawn import DrawnChart
from slipgrasp.web.charts.html import head_html
from slipgrasp.web.model.colours import css, legible

# Margin around the lines [px]; at the right for half of the last number of the time axis.
_TOP, _RIGHT, _BELOW, _LEFT = 6, 20, 28, 56
_LABEL = 14
_PALE, _BAND = 0.4, 0.12
_PAD = 0.1
_BROADER = 3.0
_NO_POINTS = uplot.Series_Points(show=False)
# Content of a plot that has space for a line but no line.
_NO_VALUES = np.empty(0)
_NO_LINE = uplot.Series(show=False)


class Plot:
    """A chart of a run, with a pale ghost.

    It has space for a ghost from the start and never loses columns: large updates arrive in parts,
    and lines without columns, or bands without lines, would then be errors.

    Args:
        gui: Parent of the widgets.
        height: Its height [px].
        drawn: Initial content.
        dark: Whether the page is dark.

    Attributes:
        lines: Node of its lines.
    """

    def __init__(self, gui: viser.GuiApi, height: int, drawn: DrawnChart, *, dark: bool) -> None:
        self._head = gui.add_html(head_html(drawn.chart, drawn.hidden, dark=dark))
        self._drawn: DrawnChart | None = drawn
        self._style = _style_of(drawn, dark)
        self._num_columns = _num_columns(drawn)
        self.lines = gui.add_uplot(
            # viser requires columns of one length initially.
            (_NO_VALUES,) * self._num_columns,
            self._series(drawn, dark),
            axes=_axes(drawn.chart),
            bands=_bands(drawn.own.chart),
            scales=_scales(drawn),
            legend=uplot.Legend(show=False),
            # The page's script zooms all charts together.
            cursor=uplot.Cursor(
                sync=uplot.Cursor_Sync(key="time"), drag=uplot.Cursor_Drag(x=False, y=False)
            ),
            height=height,
            padding=(_TOP, _RIGHT, 0, 0),
        )
        self.lines.data = self._columns(drawn)

    def draw(self, drawn: DrawnChart | None, *, dark: bool) -> None:
        """Draws another run, window or lines; without content the chart is hidden."""
        self._head.visible = self.lines.visible = drawn is not None
        if drawn is None or drawn is self._drawn:
            return
        self._drawn = drawn
        self._num_columns = max(self._num_columns, _num_columns(drawn))
        self._head.content = head_html(drawn.chart, drawn.hidden, dark=dark)
        # Columns are sent before the lines that show them, and lines before their bands.
        self.lines.data = self._columns(drawn)
        style = _style_of(drawn, dark)
        if style != self._style:
            self._style = style
            self.lines.series = self._series(drawn, dark)
            self.lines.scales = _scales(drawn)
            self.lines.bands = _bands(drawn.own.chart)
            self.lines.axes = _axes(drawn.chart)

    def resize(self, height: int) -> None:
        """Changes its height [px]."""
        self.lines.height = height

    def _columns(self, drawn: DrawnChart) -> tuple[NDArray[np.float64], ...]:
        columns = drawn.columns()
        return (*columns, *[_NO_VALUES] * (self._num_columns - len(columns)))

    def _series(self, drawn: DrawnChart, dark: bool) -> tuple[uplot.Series, ...]:
        series = _series(drawn, dark)
        return (*series, *[_NO_LINE] * (self._num_columns - len(series)))


def _num_columns(drawn: DrawnChart) -> int:
    """Time, slipping, every line of the chart, hidden or not, and as many ghost lines."""
    num_pale = len(drawn.ghost.chart.lines) if drawn.ghost else 0
    num_lines = len(drawn.chart.lines)
    return 2 + num_lines + max(num_lines, num_pale)


def _style_of(drawn: DrawnChart, dark: bool) -> object:
    """Properties that require a new layout of the plot; the page places its time range itself."""
    ghost = drawn.ghost.chart.lines if drawn.ghost else ()
    lines = [(line.key, line.label, line.colour, line.dashed) for line in drawn.own.chart.lines]
    pale = [line.colour for line in ghost]
    chart = drawn.chart
    scale = (chart.unit, chart.least, drawn.flat_range)
    return (*scale, drawn.own.chart.bands, lines, drawn.upon, pale, dark)


def _scales(drawn: DrawnChart) -> dict[str, uplot.Scale]:
    """Scales; the page's script sets that of the time to the range of the timeline."""
    chart = drawn.chart
    y = uplot.Scale(auto=True) if drawn.flat_range is None else uplot.Scale(range=drawn.flat_range)
    if chart.least > 0.0:
        # At least from -least to +least, with a margin beyond larger values.
        padding = {"pad": _PAD, "mode": 1}
        limits = {"min": {"soft": -chart.least, **padding}, "max": {"soft": chart.least, **padding}}
        y = uplot.Scale(range=limits)
    return {
        "x": uplot.Scale(time=False, auto=False),
        "y": y,
        "share": uplot.Scale(range=(0.0, 1.0)),
    }


def _axes(chart: Chart) -> tuple[uplot.Axis, ...]:
    unit = "" if chart.unit == "1" else chart.unit
    return (
        uplot.Axis(size=_BELOW, gap=2, label="time [s]", labelSize=_LABEL, labelGap=-2),
        uplot.Axis(size=_LEFT, space=22, label=unit, labelSize=_LABEL + 2),
    )


def _series(drawn: DrawnChart, dark: bool) -> tuple[uplot.Series, ...]:
    own = _lines(drawn.own.chart.lines, [len(upon) for upon in drawn.upon], 1.0, dark)
    ghost = drawn.ghost.chart.lines if drawn.ghost else ()
    pale = _lines(ghost, [0] * len(ghost), _PALE, dark)
    slipping = uplot.Series(
        label="slipping", scale="share", width=0, fill=css(SHADE, 0.13), points=_NO_POINTS
    )
    return (uplot.Series(label="time [s]"), slipping, *own, *pale)


def _lines(
    lines: Sequence[Line], upon: Sequence[int], opacity: float, dark: bool
) -> Iterator[uplot.Series]:
    """Overlaid lines; one that is covered by others is wide, so that it remains visible."""
    for line, covers in zip(lines, upon, strict=True):
        yield uplot.Series(
            label=line.label,
            stroke=css(legible(line.colour, dark=dark), opacity),
            width=(1.25 if line.dashed else 1.75) + _BROADER * covers,
            dash=(5, 4) if line.dashed else (),
            points=_NO_POINTS,
            pxAlign=0,
        )


def _bands(chart: Chart) -> tuple[uplot.Band, ...]:
    """Bands between columns of lines, which follow time and slipping."""
    columns = {line.key: 2 + i for i, line in enumerate(chart.lines)}
    colours = {line.key: line.colour for line in chart.lines}
    return tuple(
        uplot.Band(series=(columns[upper], columns[lower]), fill=css(colours[lower], _BAND), dir=-1)
        for upper, lower in chart.bands
    )
