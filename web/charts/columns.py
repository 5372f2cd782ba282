"""Columns of a chart: drawn rows of a run, and of a ghost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace, rows_from_start
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.sampling import locate

Values = NDArray[np.float64]
Rows = NDArray[np.intp]

_BUCKETS = 160
_GHOST_BUCKETS = 80


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """A chart with the drawn time range of its run.

    Attributes:
        trace: The run.
        chart: The drawn lines.
        window: Time range of the chart.
        rows: The drawn rows of the trace.
    """

    trace: Trace
    chart: Chart
    window: TimeWindow
    rows: Rows

    @classmethod
    def of(
        cls, trace: Trace, chart: Chart, window: TimeWindow, *, is_ghost: bool = False
    ) -> Drawing:
        """Selects the rows; a ghost is drawn more coarsely."""
        buckets = _GHOST_BUCKETS if is_ghost else _BUCKETS
        return cls(trace, chart, window, rows_to_draw(trace, window, chart.lines, buckets))

    def columns(self, ghost: Drawing | None = None) -> tuple[Values, ...]:
        """Time, slipping (0 or 1), the lines, and the lines of a ghost, of equal length.

        The first and the last point are exactly at the ends of the window. Outside its time range a
        ghost is NaN.

        Args:
            ghost: This chart of another run, in this window.
        """
        own = _table(self.trace, self.chart)
        times, values = self._cut(own)
        if ghost is None:
            return (times, *_columns_of(values))
        other = _table(ghost.trace, ghost.chart)
        ghost_times, ghost_values = ghost._cut(other)
        # Rows at equal times are the sides of an event: the ghost's rows follow ours.
        joined = np.concatenate([times, ghost_times])
        order = np.argsort(joined, kind="stable")
        mine, its = rows_from_start(self.trace), rows_from_start(ghost.trace)
        ours = [values, read_rows(self.trace.times[mine], own[mine], ghost_times, "right")]
        theirs = [read_rows(ghost.trace.times[its], other[its], times, "left"), ghost_values]
        solid, pale = (_columns_of(np.concatenate(both)[order]) for both in (ours, theirs))
        return (joined[order], *solid, *pale[1:])

    def _cut(self, values: Values) -> tuple[Values, Values]:
        """Times and values, from one end of the window to the other, or to the end of the run."""
        times = self.trace.times
        inside = self.rows[rows_inside(times[self.rows], self.window)]
        before, after = locate(times, self.window.start), locate(times, self.window.end)
        cut_times, cut_values = (
            np.concatenate([[before.read(rows)], rows[inside], [after.read(rows)]])
            for rows in (times, values)
        )
        return cut_times, cut_values


def event_rows(trace: Trace) -> Rows:
    """Rows on either side of an event, with equal times."""
    first = np.flatnonzero(np.diff(trace.times) == 0.0)
    return np.unique(np.concatenate([first, first + 1]))


def is_slipping(trace: Trace) -> NDArray[np.bool_]:
    """Whether any contact slips, one value per row."""
    return (trace.phase != ContactPhase.STICK).any(axis=1)


def rows_inside(times: Values, window: TimeWindow) -> NDArray[np.bool_]:
    """Mask of the times in a window, including its ends."""
    return (times >= window.start) & (times <= window.end)


def rows_to_draw(
    trace: Trace, window: TimeWindow, lines: Sequence[Line], buckets: int = _BUCKETS
) -> Rows:
    """The rows of a window that a chart needs: all of them if there are few.

    Otherwise, each bucket of rows retains the minimum and maximum of every line, and all rows at
    events are retained, except for a run that chatters, whose thousands of events cannot be
    resolved.

    Args:
        trace: The run.
        window: Time range of the chart; one row beyond each end is included, so that lines reach
            it.
        lines: The lines of the chart.
        buckets: Largest number of buckets; up to four times as many rows are drawn without
            reduction.
    """
    start = int(np.searchsorted(trace.times, window.start, side="left")) - 1
    start = max(start, rows_from_start(trace).start)
    stop = min(int(np.searchsorted(trace.times, window.end, side="right")) + 1, len(trace))
    rows = np.arange(start, stop)
    if len(rows) <= 4 * buckets:
        return rows
    size = -(-len(rows) // buckets)
    padded = np.minimum(np.arange(start, start + size * buckets), stop - 1).reshape(buckets, size)
    kept = [padded[:, 0], np.array([stop - 1])]
    events = event_rows(trace)
    if len(events) <= 4 * buckets:
        kept.append(events)
    for line in lines:
        values = line.values[padded]
        for extreme in (values.argmin(axis=1), values.argmax(axis=1)):
            kept.append(np.take_along_axis(padded, extreme[:, None], axis=1)[:, 0])
    chosen = np.unique(np.concatenate(kept))
    return chosen[(chosen >= start) & (chosen < stop)]


def read_rows(times: Values, values: Values, at: Values, side: Literal["left", "right"]) -> Values:
    """Values of signals at given times, by linear interpolation between rows.

    Args:
        times: Times of their rows, shape ``(rows,)`` [s].
        values: Their values, shape ``(rows, signals)``.
        at: Times of evaluation, shape ``(n,)`` [s].
        side: Side of an event that counts at its time: ``left`` is before it, ``right`` after it.

    Returns:
        Shape ``(n, signals)``; NaN before the start and after the end of the signals.
    """
    following = np.searchsorted(times, at, side=side)
    following = following.clip(1, len(times) - 1)
    row = following - 1
    span = times[following] - times[row]
    weight = np.divide(at - times[row], span, out=np.zeros_like(at), where=span > 0.0)
    read = values[row] + weight[:, None] * (values[following] - values[row])
    read[(at < times[0]) | (at > times[-1])] = np.nan
    return read


def _table(trace: Trace, chart: Chart) -> Values:
    """Slipping (0 or 1) and the lines of a chart, shape ``(rows, 1 + lines)``."""
    return np.column_stack(
        [is_slipping(trace).astype(float), *[line.values for line in chart.lines]]
    )


def _columns_of(values: Values) -> Values:
    """The columns of a table as contiguous arrays, for sending."""
    return np.ascontiguousarray(values.T)
