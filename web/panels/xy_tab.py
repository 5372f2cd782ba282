"""The tab of XY charts, which are drawn only while it is visible."""

from __future__ import annotations

import viser

from slipgrasp.core.trace.trace import Trace
from slipgrasp.web.charts.chosen import against_html
from slipgrasp.web.charts.drawn import ChartedRun
from slipgrasp.web.charts.html import (
    Cursors,
    Readings,
    cursor_html,
    head_html,
    note_html,
    read_lines,
    readings_html,
)
from slipgrasp.web.charts.xy import XY_TAB
from slipgrasp.web.charts.xy_drawing import DrawnXy, drawn_xy, xy_svg
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.intents.picture import SeeCharts
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.page.markup import visible_attribute


class XyTab:
    """Draws the XY charts of a run.

    Args:
        gui: Parent of the widgets.
        tab: The tab.
    """

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        self._drawn: list[DrawnXy] = []
        with tab:
            self._readings = gui.add_html("")
            self._cursors = gui.add_html("")
            self._pictures = gui.add_html("")
            self._note = gui.add_html("", visible=False)
            self._question = gui.add_html(_SENTINEL)

    def draw(
        self,
        run: ChartedRun,
        ghost: ChartedRun | None,
        window: TimeWindow,
        charts_view: ChartsView,
        ghost_label: str,
        *,
        dark: bool,
    ) -> None:
        """Draws the charts while the tab is visible."""
        self._question.content = _SENTINEL + against_html(run.trace, charts_view)
        pale = (ghost.trace, ghost.xy) if ghost else None
        self._drawn = drawn_xy(run.trace, run.xy, window, charts_view, pale)
        self._pictures.content = "".join(
            f"{head_html(xy.xy.chart, xy.hidden, dark=dark)}{xy_svg(xy, dark=dark)}"
            for xy in self._drawn
        )
        is_pale = any(xy.ghost for xy in self._drawn)
        self._note.content = note_html([f"Ghost: {ghost_label}."])
        self._note.visible = is_pale

    def read(self, trace: Trace, cursors: Cursors) -> None:
        """Shows the positions on the curves at the play head and at the second cursor."""
        self._cursors.content = cursor_html(cursors)
        self._readings.content = readings_html(
            Readings(
                time=cursors.time,
                values={
                    xy.xy.chart.key: read_lines(xy.xy.chart, trace, cursors, xy.largest)
                    for xy in self._drawn
                },
                changes=(),
                mark=cursors.mark,
                spots={xy.xy.chart.key: xy.spots(cursors.time) for xy in self._drawn},
                marked={xy.xy.chart.key: xy.spots(cursors.mark) for xy in self._drawn}
                if cursors.mark is not None
                else {},
            )
        )


_SENTINEL = f"<div {visible_attribute(SeeCharts, tab=XY_TAB)} style='height:1px'></div>"
