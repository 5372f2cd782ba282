"""The reducer of the charts."""

from __future__ import annotations

import math
from dataclasses import replace

from slipgrasp.web.charts.charts import CHART_TABS
from slipgrasp.web.charts.chosen import CHOSEN_TAB, choosable
from slipgrasp.web.charts.drawn import ChartedRun
from slipgrasp.web.charts.law_charts import LAWS_TAB
from slipgrasp.web.charts.xy import XY_TAB
from slipgrasp.web.model.charts_view import MOST_CHOSEN, ChartsView
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    DrawAgainst,
    LayOutCharts,
    PlaceMark,
    SeeCharts,
    ToggleLine,
    ToggleMark,
    ToggleSignal,
)
from slipgrasp.web.model.playback import Playback, whole_window
from slipgrasp.web.model.view import Shown, ViewState
from slipgrasp.web.reducers.reducer import Reducer

_TABS = (*CHART_TABS, CHOSEN_TAB, XY_TAB, LAWS_TAB)


class ChartsReducer(Reducer):
    """Hides lines of the charts, adds signals and a second cursor, and undoes these changes."""

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Changes the charts; requests for missing signals have no effect."""
        charts = _laid_out(intent, view.charts)
        if view.shown is not None and view.playback is not None:
            charts = _changed(intent, charts, view.shown, view.playback)
        return view if charts == view.charts else replace(view, charts=charts)


def _laid_out(intent: Intent, charts: ChartsView) -> ChartsView:
    """The charts after a request that is independent of a run."""
    match intent:
        case LayOutCharts(layout):
            return charts.laid_out(layout)
        case SeeCharts(tab, is_visible) if tab in _TABS:
            return charts.with_tab_seen(tab, is_visible)
        case _:
            return charts


def _changed(intent: Intent, charts: ChartsView, shown: Shown, playback: Playback) -> ChartsView:
    result = shown.result
    match intent:
        case ToggleLine(chart, line):
            known = ChartedRun.of(result, view=charts).lines()
            return charts.toggled(chart, line) if (chart, line) in known else charts
        case ToggleSignal(name) if name in charts.chosen:
            return charts.with_signal_toggled(name)
        case ToggleSignal(part) if part and len(charts.chosen) < MOST_CHOSEN:
            free = [name for name in choosable(result.trace) if name not in charts.chosen]
            found = min(
                (name for name in free if part.lower() in name.lower()), key=len, default=None
            )
            return charts if found is None else charts.with_signal_toggled(found)
        case DrawAgainst(name) if not name or name in choosable(result.trace):
            return replace(charts, across=name)
        case PlaceMark(time) if math.isfinite(time):
            return replace(charts, mark=whole_window(result).clamp(time))
        case ToggleMark():
            return replace(charts, mark=playback.time if charts.mark is None else None)
        case _:
            return charts
