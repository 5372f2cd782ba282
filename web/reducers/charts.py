"""The reducer of the charts."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import ToggleLine
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer


class ChartsReducer(Reducer):
    """Hides lines of the charts, and brings them back."""

    takes: ClassVar[tuple[type[Intent], ...]] = (ToggleLine,)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Hides a line, or brings it back; one that no chart of the run has is nothing."""
        if not isinstance(intent, ToggleLine) or view.shown is None:
            return view
        known = {
            (chart.key, line.key)
            for charts in charts_of(view.shown.result).values()
            for chart in charts
            for line in chart.lines
        }
        if (intent.chart, intent.line) not in known:
            return view
        return replace(view, charts=view.charts.toggled(intent.chart, intent.line))
