"""The reducer of the charts."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from slipgrasp.web.charts.chosen import MOST_CHOSEN, choosable
from slipgrasp.web.charts.drawn import ChartedRun
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import ToggleLine, ToggleSignal
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer


class ChartsReducer(Reducer):
    """Hides lines of the charts and adds signals to them, and takes both back."""

    takes: ClassVar[tuple[type[Intent], ...]] = (ToggleLine, ToggleSignal)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Hides a line or adds a signal, or takes it back; one that the run lacks is nothing."""
        if view.shown is None:
            return view
        result, charts = view.shown.result, view.charts
        match intent:
            case ToggleLine(chart, line):
                tabs = ChartedRun.of(result, chosen=charts.chosen).tabs.values()
                known = {(c.key, each.key) for tab in tabs for c in tab for each in c.lines}
                if (chart, line) in known:
                    charts = charts.toggled(chart, line)
            case ToggleSignal(name) if name in charts.chosen:
                charts = charts.with_signal_toggled(name)
            case ToggleSignal(name) if len(charts.chosen) < MOST_CHOSEN:
                if name in choosable(result.trace):
                    charts = charts.with_signal_toggled(name)
        return view if charts == view.charts else replace(view, charts=charts)
