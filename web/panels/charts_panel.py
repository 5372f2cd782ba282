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
    values_at,
)
from web.colours import SHADE, css
from web.playback import Playback, TimeWindow
from web.view import ViewState

__all__ = ["ChartsPanel", "is_mark_due"]

_MARK_INTERVAL = 0.1
_MARKS_PER_WINDOW = 300
# Room around the lines of a plot [px].
_TOP, _RIGHT, _BELOW, _LEFT = 6, 12, 42, 62
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
                self._take(view.shown.result, playback.window)
                self._ticket, self._window = view.shown.ticket, playback.window
            for plot in self._visible_plots():
                plot.mark(playback)
        self._marked, self._marked_at = playback.time, now

    def remove(self) -> None:
        """Takes everything off the page."""
        self._group.remove()
        self._plots = {name: [] for name in _TABS}

    def _visible_plots(self) -> list[_Plot]:
        return [plot for plots in self._plots.values() for plot in plots if plot.visible]

    def _take(self, result: RunResult, window: TimeWindow) -> None:
        """Gives every chart of a run a plot; plots are made once, and hidden while unused."""
        for name, make_charts in _TABS.items():
            charts, plots = make_charts(result), self._plots[name]
            with self._tabs[name]:
                for chart in charts[len(plots) :]:
                    data = _Data(result, chart, window)
                    plots.append(_Plot(self._client.gui, data, self._height))
            for plot, chart in zip_longest(plots, charts):
                plot.draw(None if chart is None else _Data(result, chart, window))
        self._tell_what_is_drawn(result, window)

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
    """A chart of a run with the stretch of it that is drawn."""

    def __init__(self, result: RunResult, chart: Chart, window: TimeWindow) -> None:
        self.chart, self.window = chart, window
        self.rows = rows_to_draw(result.trace, window, chart.lines)
        self._trace = result.trace

    def columns(self) -> tuple[NDArray[np.float64], ...]:
        """Time, slipping, and lines."""
        return chart_data(self._trace, self.chart, self.window, self.rows)

    def values(self, time: float) -> list[float]:
        """What each line shows at a time [s]."""
        return values_at(self._trace, self.chart, time)


class _Plot:
    """One chart on the page: a head with a legend that reads the play head, and the lines.

    The play head is a stroke that belongs to the head and reaches over the lines, so that
    moving it sends some words and never the lines again.

    Args:
        gui: Where it goes.
        data: What it shows first.
        height: Its height [px].
    """

    def __init__(self, gui: viser.GuiApi, data: _Data, height: int) -> None:
        self.visible = True
        self._data, self._height = data, height
        self._head = gui.add_html("")
        self._lines = gui.add_uplot(
            data.columns(),
            _series(data.chart),
            axes=_axes(data.chart),
            scales={
                "x": uplot.Scale(time=False),
                "y": uplot.Scale(auto=True),
                "share": uplot.Scale(range=(0.0, 1.0)),
            },
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(
                sync=uplot.Cursor_Sync(key="time"), drag=uplot.Cursor_Drag(x=False, y=False)
            ),
            height=height,
            padding=(_TOP, _RIGHT, 0, 0),
        )

    @property
    def rows(self) -> NDArray[np.intp]:
        """The rows of the trace that are drawn."""
        return self._data.rows

    def draw(self, data: _Data | None) -> None:
        """Draws a chart of another run or window; without one it hides."""
        self.visible = self._head.visible = self._lines.visible = data is not None
        if data is None:
            return
        if _look(data.chart) != _look(self._data.chart):
            self._lines.series = _series(data.chart)
            self._lines.axes = _axes(data.chart)
        self._data = data
        self._lines.data = data.columns()

    def mark(self, playback: Playback) -> None:
        """Moves the play head, and reads the lines off there."""
        values = self._data.values(playback.time)
        share = (playback.time - self._data.window.start) / max(self._data.window.length, 1e-12)
        self._head.content = _head_html(self._data.chart, values) + _mark_html(share, self._height)


def _look(chart: Chart) -> object:
    """What makes the page lay a plot out anew."""
    return (chart.unit, [(line.label, line.colour, line.dashed) for line in chart.lines])


def _axes(chart: Chart) -> tuple[uplot.Axis, ...]:
    unit = "" if chart.unit == "1" else chart.unit
    return (
        uplot.Axis(size=_BELOW - 14, gap=2, label="time [s]", labelSize=14, labelGap=-2),
        uplot.Axis(size=_LEFT - 16, space=22, label=unit, labelSize=16),
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
    return (uplot.Series(label="time [s]"), slipping, *lines)


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


def _mark_html(share: float, height: int) -> str:
    """The stroke of the play head, over the plot that follows.

    Args:
        share: Where it stands, as a share of the window.
        height: Height of the plot [px].
    """
    # Around a plot the page leaves a margin, and draws a frame of one pixel.
    room = "var(--mantine-spacing-xs)"
    across = f"(100% - 2*{room} - {_LEFT + _RIGHT}px)"
    left = f"calc({room} + {_LEFT + 1}px + {across}*{share:.5f} - 0.6px)"
    return (
        "<div style='position:relative;height:0;z-index:1;pointer-events:none'>"
        f"<div style='position:absolute;left:{left};top:calc({room} + {_TOP + 1}px);"
        f"height:{height - _TOP - _BELOW}px;width:1.2px;background:currentColor'></div></div>"
    )
