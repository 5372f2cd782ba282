"""The drawn charts of a run: window, hidden lines, and a ghost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import Trace, rows_from_start
from slipgrasp.core.words.phrases import joined
from slipgrasp.web.charts.chart import Chart
from slipgrasp.web.charts.charts import CHART_TABS
from slipgrasp.web.charts.chosen import CHOSEN_TAB, chosen_charts
from slipgrasp.web.charts.columns import Drawing, event_rows, rows_inside
from slipgrasp.web.charts.xy import XyChart, chosen_xy_charts, xy_charts
from slipgrasp.web.model.charts_view import PLAIN, ChartsView
from slipgrasp.web.model.playback import TimeWindow

_LEAST_SPREAD = 1e-3
"""Relative difference of lines below which all ticks would have the same label."""
_COINCIDE = 0.004
"""Relative difference of lines below which they hide each other."""


class _Tabs(Mapping[str, tuple[Chart, ...]]):
    """Charts of a run over time, by tab; those of a tab are made when they are first needed."""

    def __init__(self, result: RunResult, chosen: Sequence[str]) -> None:
        self._makers = {
            **{tab: partial(make, result) for tab, make in CHART_TABS.items()},
            CHOSEN_TAB: partial(chosen_charts, result, chosen),
        }
        self._made: dict[str, tuple[Chart, ...]] = {}

    def __getitem__(self, tab: str) -> tuple[Chart, ...]:
        if tab not in self._made:
            self._made[tab] = tuple(self._makers[tab]())
        return self._made[tab]

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


@dataclass(frozen=True, eq=False)
class ChartedRun:
    """A run with its charts by tab, and the selected signals.

    Attributes:
        result: The run.
        chosen: Names of the signals that have charts of the user's choice.
        across: Name of the signal against which these are also drawn.
    """

    result: RunResult
    chosen: tuple[str, ...]
    across: str

    @classmethod
    def of(
        cls, result: RunResult, known: Sequence[ChartedRun] = (), view: ChartsView = PLAIN
    ) -> ChartedRun:
        """The run with its charts, which are reused if they exist."""
        made = next((run for run in known if run.result is result), None)
        if made is not None and (made.chosen, made.across) == (view.chosen, view.across):
            return made
        return cls(result, view.chosen, view.across)

    @property
    def trace(self) -> Trace:
        """The samples of the run."""
        return self.result.trace

    @cached_property
    def tabs(self) -> Mapping[str, tuple[Chart, ...]]:
        """Its charts over time, by tab."""
        return _Tabs(self.result, self.chosen)

    @cached_property
    def xy(self) -> tuple[XyChart, ...]:
        """Its charts of one quantity against another."""
        chosen = chosen_xy_charts(self.result, self.chosen, self.across)
        return (*xy_charts(self.result), *chosen)

    def lines(self) -> Iterator[tuple[str, str]]:
        """Every line that can be hidden: key of its chart, and its key."""
        charts = chain(*self.tabs.values(), (xy.chart for xy in self.xy))
        return ((chart.key, line.key) for chart in charts for line in chart.lines)


@dataclass(frozen=True, eq=False)
class DrawnChart:
    """A drawn chart.

    Attributes:
        chart: The chart with all its lines.
        hidden: Keys of the hidden lines.
        own: The drawn lines.
        ghost: These lines of another run, if there is one.
    """

    chart: Chart
    hidden: frozenset[str]
    own: Drawing
    ghost: Drawing | None = None

    def columns(self) -> tuple[NDArray[np.float64], ...]:
        """Time, slipping (0 or 1), the lines, and those of the ghost."""
        return self.own.columns(self.ghost)

    @cached_property
    def scale(self) -> float:
        """The largest absolute value of the run in the chart, at least the minimum range."""
        rows = [np.abs(line.values[self.own.rows]) for line in self.own.chart.lines]
        sizes = [float(values.max(initial=0.0)) for values in rows]
        return max([self.chart.least, *(size for size in sizes if np.isfinite(size))])

    @cached_property
    def flat_range(self) -> tuple[float, float] | None:
        """A note for a chart whose lines differ by less than its labels show; None for others.

        Without it, the page would divide by rounding errors, or fail.
        """
        drawings = (self.own, self.ghost) if self.ghost else (self.own,)
        values = [line.values[d.rows] for d in drawings for line in d.chart.lines]
        known = np.concatenate([*values, np.empty(0)])
        known = known[np.isfinite(known)]
        if self.chart.least > 0.0 or len(known) == 0:
            return None
        low, high = float(known.min()), float(known.max())
        margin = _LEAST_SPREAD * max(abs(low), abs(high))
        return (low - margin, high + margin) if 0.0 < high - low < margin else None

    @cached_property
    def upon(self) -> tuple[tuple[int, ...], ...]:
        """For each drawn line, the later ones that coincide with it."""
        rows = [line.values[self.own.rows] for line in self.own.chart.lines]
        near = _COINCIDE * self.scale
        return tuple(
            tuple(k for k in range(i + 1, len(rows)) if np.abs(rows[k] - rows[i]).max() <= near)
            for i in range(len(rows))
        )


def drawn_charts(
    run: ChartedRun,
    ghost: ChartedRun | None,
    window: TimeWindow,
    charts_view: ChartsView,
    tab: str,
) -> list[DrawnChart]:
    """The charts of a run under a tab as they are drawn.

    Args:
        run: The run.
        ghost: Another run, whose corresponding charts are drawn.
        window: The time range.
        charts_view: State of the charts, with the hidden lines.
        tab: The tab.
    """
    of_ghost = {chart.key: chart for chart in ghost.tabs[tab]} if ghost else {}

    def draw(chart: Chart) -> DrawnChart:
        hidden = charts_view.hidden_in(chart.key)
        own = Drawing.of(run.trace, _without(chart, hidden), window)
        other = of_ghost.get(chart.key)
        if ghost is None or other is None:
            return DrawnChart(chart, hidden, own)
        known = _without(other, hidden | _unknown_in(other))
        pale = Drawing.of(ghost.trace, known, window, is_ghost=True)
        return DrawnChart(chart, hidden, own, pale)

    return [draw(chart) for chart in run.tabs[tab]]


def remarks_on(charts: Sequence[DrawnChart]) -> Iterator[str]:
    """Notes about omitted content, a sentence each."""
    coarse = [chart for chart in charts if not _is_whole(chart.own)]
    if coarse:
        own = min((chart.own for chart in coarse), key=lambda drawing: len(drawing.rows))
        inside = _rows_of_window(own)
        events = np.intersect1d(event_rows(own.trace), inside)
        kept = " and every event" if np.isin(events, own.rows).all() else ""
        yield (
            f"Charts show at least {len(own.rows)} of {len(inside)} samples: every extreme{kept}."
        )
    upon = [words for chart in charts for words in _words_upon(chart)]
    if upon:
        yield f"Coincident lines: {', '.join(upon)}."
    for chart in charts:
        labels = [line.label for line in chart.chart.lines if line.key in chart.hidden]
        if labels:
            yield f"{chart.chart.title}: {', '.join(labels)} hidden."


def _words_upon(drawn: DrawnChart) -> Iterator[str]:
    """Lines that hide others, each once, unless all are zero.

    Lines with one label, such as true values of several estimates, count as one.
    """
    lines, told = drawn.own.chart.lines, set[int]()
    if drawn.scale > drawn.chart.least:
        for line, upon in zip(lines, drawn.upon, strict=True):
            new = [k for k in upon if k not in told and lines[k].label != line.label]
            told.update(upon)
            if new:
                yield f"{joined([lines[k].label for k in new])} on {line.label}"


def _is_whole(drawing: Drawing) -> bool:
    return bool(np.isin(_rows_of_window(drawing), drawing.rows).all())


def _rows_of_window(drawing: Drawing) -> NDArray[np.intp]:
    rows = np.flatnonzero(rows_inside(drawing.trace.times, drawing.window))
    return rows[rows >= rows_from_start(drawing.trace).start]


def _unknown_in(chart: Chart) -> frozenset[str]:
    """Keys of the lines without values, of signals that were not measured.

    With such a line the page would find no range, and draw no line of the chart.
    """
    return frozenset(line.key for line in chart.lines if np.isnan(line.values).all())


def _without(chart: Chart, hidden: frozenset[str]) -> Chart:
    """The chart without some of its lines."""
    if not hidden:
        return chart
    lines = tuple(line for line in chart.lines if line.key not in hidden)
    bands = tuple(band for band in chart.bands if hidden.isdisjoint(band))
    return replace(chart, lines=lines, bands=bands)
