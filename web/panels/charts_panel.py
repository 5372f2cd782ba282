"""Charts in tabs, each with a legend that shows values at the play head."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import zip_longest

import viser

from slipgrasp.core.trace.trace import Trace
from slipgrasp.web.charts.charts import CHART_TABS, ESTIMATES_TAB
from slipgrasp.web.charts.chosen import CHOSEN_TAB, search_html
from slipgrasp.web.charts.drawn import ChartedRun, DrawnChart, drawn_charts, remarks_on
from slipgrasp.web.charts.html import (
    Cursors,
    Readings,
    cursor_html,
    note_html,
    read_lines,
    readings_html,
)
from slipgrasp.web.charts.law_charts import LAWS_TAB
from slipgrasp.web.charts.plot import Plot
from slipgrasp.web.charts.xy import XY_TAB
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.intents.picture import SeeCharts
from slipgrasp.web.model.playback import Playback, TimeWindow
from slipgrasp.web.model.view import Ghost, Shown, ViewState
from slipgrasp.web.page.markup import visible_attribute
from slipgrasp.web.panels.laws_tab import LawsTab
from slipgrasp.web.panels.xy_tab import XyTab

_READING_INTERVAL = 0.1
_READINGS_PER_WINDOW = 300


def is_reading_due(shown: float, wanted: float, window: TimeWindow, since: float) -> bool:
    """Whether the play head has moved enough to update the legends.

    Args:
        shown: Time of the shown values [s].
        wanted: Time of the play head [s].
        window: Time range of the charts.
        since: Time since the last update [s].
    """
    moved = abs(wanted - shown)
    return since >= _READING_INTERVAL and moved >= window.length / _READINGS_PER_WINDOW


class ChartsPanel:
    """Panel with the charts of the run and its ghost.

    Args:
        client: The viewer.
        height: Height of one chart [px].
    """

    def __init__(self, client: viser.ClientHandle, height: int) -> None:
        self._client = client
        self._group = client.gui.add_tab_group()
        handles = {name: self._group.add_tab(name) for name in (*CHART_TABS, CHOSEN_TAB)}
        self._estimates = handles[ESTIMATES_TAB]
        self._tabs = {name: _Tab(client.gui, tab, name, height) for name, tab in handles.items()}
        self._xy = XyTab(client.gui, self._group.add_tab(XY_TAB))
        self._laws = LawsTab(client.gui, self._group.add_tab(LAWS_TAB))
        self._shown: Shown | None = None
        self._ghost: Ghost | None = None
        self._run: ChartedRun | None = None
        self._ghost_run: ChartedRun | None = None
        self._drawing: tuple[TimeWindow, ChartsView, bool, bool] | None = None
        self._drawn: set[str] = set()
        self._asked: object = None
        self._read, self._read_at = Cursors(0.0, None), 0.0

    def update(self, view: ViewState) -> None:
        """Draws a new run or window immediately.

        While the run plays, values of XY charts and of a second cursor are updated ten times a
        second.
        """
        if view.shown is None or view.playback is None:
            return
        self._laws.update(view)
        shape = view.shown.result.trace.shape
        self._show_estimates(bool(shape.unknowns or shape.diagnostics))
        playback, now = view.playback, time.monotonic()
        run = self._take_runs(view.shown, view.ghost, view.charts)
        cursors = Cursors(playback.time, view.charts.mark)
        charts = replace(view.charts, mark=None, seen=frozenset())
        drawing = (playback.window, charts, view.appearance.dark, view.appearance.lecture)
        if drawing != self._drawing:
            self._drawing, self._drawn = drawing, set()
        due = _tabs_in_sight(view.charts) - self._drawn
        if not (due or self._must_read(playback, cursors, view.charts.seen, now)):
            return
        with self._client.atomic():
            self._draw(due, run, view, playback.window)
            self._drawn |= due
            changes = [change.time for change in view.shown.result.scenario.changes]
            for name in self._drawn & self._tabs.keys():
                self._tabs[name].read(run.trace, cursors, changes)
            if XY_TAB in self._drawn:
                self._xy.read(run.trace, cursors)
        self._read, self._read_at = cursors, now

    def _show_estimates(self, is_shown: bool) -> None:
        """Hides the tab of estimates in runs without any; viser itself cannot hide tabs."""
        tabs = self._group._tab_handles
        if is_shown == (self._estimates in tabs):
            return
        if is_shown:
            tabs.insert([*self._tabs].index(ESTIMATES_TAB), self._estimates)
        else:
            tabs.remove(self._estimates)
        self._group._rebuild_tab_props()

    def _draw(self, due: set[str], run: ChartedRun, view: ViewState, window: TimeWindow) -> None:
        """Draws the charts under some tabs."""
        ghost, dark = self._ghost_run, view.appearance.dark
        label = view.ghost.label if view.ghost else ""
        for name in (each for each in self._tabs if each in due):
            charts = drawn_charts(run, ghost, window, view.charts, name)
            self._tabs[name].draw(
                charts[:1] if view.appearance.lecture else charts, label, dark=dark
            )
        if CHOSEN_TAB in due:
            # The names of the signals, of which there are hundreds, rarely change.
            asked = (run.trace.shape, run.trace.absent, run.chosen)
            if asked != self._asked:
                self._asked = asked
                self._tabs[CHOSEN_TAB].ask(search_html(run.trace, run.chosen))
        if XY_TAB in due:
            self._xy.draw(run, ghost, window, view.charts, label, dark=dark)

    def resize(self, height: int) -> None:
        """Changes the height of the charts over time [px]."""
        for tab in self._tabs.values():
            tab.resize(height)

    def _take_runs(self, shown: Shown, ghost: Ghost | None, charts_view: ChartsView) -> ChartedRun:
        """The charts of the run; those of another run are drawn later."""
        choice = (charts_view.chosen, charts_view.across)
        is_same = self._run is not None and (self._run.chosen, self._run.across) == choice
        if self._run is None or not is_same or shown is not self._shown or ghost is not self._ghost:
            # A run that becomes the ghost of the next one already has its charts.
            known = [run for run in (self._run, self._ghost_run) if run is not None]
            self._shown, self._ghost, self._drawing = shown, ghost, None
            self._run = ChartedRun.of(shown.result, known, charts_view)
            pale = ghost.shown.result if ghost else None
            self._ghost_run = ChartedRun.of(pale, known, charts_view) if pale else None
        return self._run

    def _must_read(
        self, playback: Playback, cursors: Cursors, seen: Collection[str], now: float
    ) -> bool:
        if not playback.playing:
            return cursors != self._read
        if cursors.mark is None and XY_TAB not in seen:
            return False  # The page reads the lines that it has.
        since = now - self._read_at
        return is_reading_due(self._read.time, playback.time, playback.window, since)


def _tabs_in_sight(charts: ChartsView) -> set[str]:
    """Visible tabs; charts of other tabs are drawn once they become visible.

    The first tab counts as visible until the page has reported its tabs.
    """
    drawable = {*CHART_TABS, CHOSEN_TAB, XY_TAB}
    return {*charts.seen} & drawable or {next(iter(CHART_TABS))}


class _Tab:
    """The charts in one tab; unused plots are hidden and reused."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, name: str, height: int) -> None:
        self._gui, self._tab, self._height = gui, tab, height
        self._plots: list[Plot] = []
        self._drawn: Sequence[DrawnChart] = ()
        with tab:
            gui.add_html(f"<i {visible_attribute(SeeCharts, tab=name)}></i>")
            self._question = gui.add_html("", visible=False)
            self._readings = gui.add_html("")
            self._cursors = gui.add_html("")
            self._note = gui.add_html("", visible=False)

    def draw(self, charts: Sequence[DrawnChart], ghost_label: str, *, dark: bool) -> None:
        """Draws charts, and shows notes about them."""
        self._drawn = charts
        with self._tab:
            for chart in charts[len(self._plots) :]:
                self._plots.append(Plot(self._gui, self._height, chart, dark=dark))
        for plot, chart in zip_longest(self._plots, charts):
            plot.draw(chart, dark=dark)
        remarks = [*remarks_on(charts)]
        if any(chart.ghost for chart in charts):
            remarks.insert(0, f"Ghost: {ghost_label}.")
        self._note.visible = bool(remarks)
        self._note.content = note_html(remarks)

    def resize(self, height: int) -> None:
        """Changes the height of these charts, including later ones [px]."""
        self._height = height
        for plot in self._plots:
            plot.resize(height)

    def ask(self, html: str) -> None:
        """Shows HTML above the charts."""
        self._question.content, self._question.visible = html, True

    def read(self, trace: Trace, cursors: Cursors, changes: Sequence[float]) -> None:
        """Shows values at the cursors, and times of parameter changes [s]."""
        self._cursors.content = cursor_html(cursors)
        values = {
            drawn.chart.key: read_lines(drawn.chart, trace, cursors, drawn.scale)
            for drawn in self._drawn
        }
        self._readings.content = readings_html(
            Readings(cursors.time, values, changes, cursors.mark)
        )
