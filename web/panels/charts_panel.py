"""Live charts, with a mark where the play head stands."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from html import escape
from itertools import zip_longest

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from core.result import RunResult
from web.charts import (
    Chart,
    chart_data,
    contact_charts,
    control_charts,
    event_rows,
    rows_to_draw,
)
from web.colours import MARK, SHADE, css
from web.playback import Playback, TimeWindow
from web.view import ViewState

__all__ = ["ChartsPanel", "is_mark_due"]

_MARK_INTERVAL = 0.1
_MARKS_PER_WINDOW = 300
_NUDGE = 1e-6
_TABS: dict[str, Callable[[RunResult], tuple[Chart, ...]]] = {
    "Contact": contact_charts,
    "Control": control_charts,
}


def is_mark_due(shown: float, wanted: float, window: TimeWindow, since: float) -> bool:
    """Whether the mark has moved far enough to be drawn again.

    Args:
        shown: Where it is drawn [s].
        wanted: Where the play head stands [s].
        window: What the charts show.
        since: How long ago it was drawn [s].
    """
    moved = abs(wanted - shown)
    return since >= _MARK_INTERVAL and moved >= window.length / _MARKS_PER_WINDOW


class ChartsPanel:
    """Shows the charts of the run under tabs.

    Args:
        client: The viewer.
        height: Height of one chart [px].
    """

    def __init__(self, client: viser.ClientHandle, height: int) -> None:
        self._client, self._height = client, height
        self._group = client.gui.add_tab_group()
        self._tabs = {name: self._group.add_tab(name) for name in _TABS}
        with self._tabs["Contact"]:
            self._note = client.gui.add_html("", visible=False)
        self._plots: dict[str, list[_Plot]] = {name: [] for name in _TABS}
        self._ticket = 0
        self._window: TimeWindow | None = None
        self._marked, self._marked_at = 0.0, 0.0

    def update(self, view: ViewState) -> None:
        """Draws a new run or window at once, and the mark ten times a second."""
        if view.shown is None or view.playback is None:
            return
        playback, now = view.playback, time.monotonic()
        is_new = view.shown.ticket != self._ticket or playback.window != self._window
        settled = not playback.playing and playback.time != self._marked
        due = is_mark_due(self._marked, playback.time, playback.window, now - self._marked_at)
        if not (is_new or settled or due):
            return
        with self._client.atomic():
            if is_new:
                self._take(view.shown.result, playback)
                self._ticket, self._window = view.shown.ticket, playback.window
            for plot in self._visible_plots():
                plot.draw(playback)
        self._marked, self._marked_at = playback.time, now

    def remove(self) -> None:
        """Takes everything off the page."""
        self._group.remove()
        self._plots = {name: [] for name in _TABS}

    def _visible_plots(self) -> list[_Plot]:
        return [plot for plots in self._plots.values() for plot in plots if plot.visible]

    def _take(self, result: RunResult, playback: Playback) -> None:
        """Gives every chart of a run a plot; plots are made once, and hidden while unused."""
        for name, make_charts in _TABS.items():
            charts, plots = make_charts(result), self._plots[name]
            with self._tabs[name]:
                for chart in charts[len(plots) :]:
                    data = _Data(result, chart, playback)
                    plots.append(_Plot(self._client.gui, data, playback, self._height))
            for plot, chart in zip_longest(plots, charts):
                plot.take(None if chart is None else _Data(result, chart, playback))
        self._tell_what_is_drawn(result, playback.window)

    def _tell_what_is_drawn(self, result: RunResult, window: TimeWindow) -> None:
        """Says so where a chart does not draw every sample."""
        times = result.trace.times
        inside = np.flatnonzero((times >= window.start) & (times <= window.end))
        fewest = min((plot.rows for plot in self._visible_plots()), key=len)
        events = np.intersect1d(event_rows(result.trace), inside)
        what = "every extreme and every event" if np.isin(events, fewest).all() else "every extreme"
        self._note.visible = len(fewest) < len(inside)
        self._note.content = (
            "<div style='font-size:0.75em;opacity:0.7;padding:0 0.75em'>Charts show at least "
            f"{len(fewest)} of {len(inside)} samples: {what}.</div>"
        )


class _Data:
    """A chart of a run with the rows of it that are drawn."""

    def __init__(self, result: RunResult, chart: Chart, playback: Playback) -> None:
        self.chart = chart
        self.rows = rows_to_draw(result.trace, playback.window, chart.lines)
        self._trace = result.trace

    def columns(self, playback: Playback) -> tuple[NDArray[np.float64], ...]:
        """Time, slipping, lines, and the mark of the play head."""
        return chart_data(self._trace, self.chart, playback.window, self.rows, playback.time)


class _Plot:
    """One chart on the page: a head with a legend that reads the play head, and the lines.

    Args:
        gui: Where it goes.
        data: What it shows first.
        playback: With what window.
        height: Its height [px].
    """

    def __init__(self, gui: viser.GuiApi, data: _Data, playback: Playback, height: int) -> None:
        self.visible = True
        self._data = data
        self._nudge = _NUDGE
        self._head = gui.add_html("")
        self._lines = gui.add_uplot(
            data.columns(playback),
            _series(data.chart),
            axes=_axes(data.chart),
            scales={
                "x": uplot.Scale(time=False),
                "y": uplot.Scale(auto=True),
                "share": uplot.Scale(range=(0.0, 1.0)),
            },
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(sync=uplot.Cursor_Sync(key="time")),
            height=height,
            padding=(6, 12, 0, 0),
        )

    @property
    def rows(self) -> NDArray[np.intp]:
        """The rows of the trace that are drawn."""
        return self._data.rows

    def take(self, data: _Data | None) -> None:
        """Takes a chart of another run or window; without one it hides."""
        self.visible = self._head.visible = self._lines.visible = data is not None
        if data is None:
            return
        if _look(data.chart) != _look(self._data.chart):
            self._lines.series = _series(data.chart)
            self._lines.axes = _axes(data.chart)
        self._data = data

    def draw(self, playback: Playback) -> None:
        """Draws the lines in the window, and reads them off at the play head."""
        columns = self._data.columns(playback)
        # uPlot lays out its time axis only when its range changes, and a plot that was made
        # before the page had its size would keep an axis without numbers.
        self._nudge = -self._nudge
        columns[0][-1] += self._nudge * playback.window.length
        self._lines.data = columns
        place = int(np.flatnonzero(columns[-1] == 1.0)[0])
        values = [float(column[place]) for column in columns[2:-1]]
        self._head.content = _head_html(self._data.chart, values)


def _look(chart: Chart) -> object:
    """What makes the page lay a plot out anew."""
    return (chart.unit, [(line.label, line.colour, line.dashed) for line in chart.lines])


def _axes(chart: Chart) -> tuple[uplot.Axis, ...]:
    unit = "" if chart.unit == "1" else chart.unit
    return (
        uplot.Axis(size=28, gap=2, label="time [s]", labelSize=14, labelGap=-2),
        uplot.Axis(size=46, space=22, label=unit, labelSize=16),
    )


def _series(chart: Chart) -> tuple[uplot.Series, ...]:
    hidden = uplot.Series_Points(show=False)
    lines = [
        uplot.Series(
            label=line.label,
            stroke=css(line.colour),
            width=1.5 if line.dashed else 2.25,
            dash=(5, 4) if line.dashed else (),
            points=hidden,
            pxAlign=0,
        )
        for line in chart.lines
    ]
    slipping = uplot.Series(
        label="slipping", scale="share", width=0, fill=css(SHADE, 0.13), points=hidden
    )
    mark = uplot.Series(
        label="play head", scale="share", stroke=css(MARK), width=1.25, points=hidden
    )
    return (uplot.Series(label="time [s]"), slipping, *lines, mark)


def _head_html(chart: Chart, values: Sequence[float]) -> str:
    """Title with unit, and each line's value where the play head stands."""
    entries = "".join(
        f"<span style='white-space:nowrap;margin-right:0.9em'>"
        f"<span style='color:{css(line.colour)};font-weight:700'>{'┄' if line.dashed else '━'}"
        f"</span> {escape(line.label)} <b>{value:.4g}</b></span> "
        for line, value in zip(chart.lines, values, strict=True)
    )
    unit = f" [{chart.unit}]" if chart.unit != "1" else ""
    return (
        "<div style='padding:0.35em 0.75em 0;line-height:1.25'>"
        f"<div style='font-weight:600;font-size:0.9em'>{escape(chart.title)}{escape(unit)}</div>"
        f"<div style='font-size:0.78em;font-variant-numeric:tabular-nums'>{entries}</div></div>"
    )
