"""The columns of a chart: which rows of a run are drawn, and another run beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace, rows_from_start
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.charts.charts import Chart, Line
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.sampling import locate

Values = NDArray[np.float64]
Rows = NDArray[np.intp]

_BUCKETS = 160
_GHOST_BUCKETS = 80


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """A chart with the time range of its run that is drawn.

    Attributes:
        trace: The run.
        chart: Its lines; only those that are drawn.
        window: What the chart shows.
        rows: The rows of the trace that are drawn.
    """

    trace: Trace
    chart: Chart
    window: TimeWindow
    rows: Rows

    @classmethod
    def of(
        cls, trace: Trace, chart: Chart, window: TimeWindow, *, is_ghost: bool = False
    ) -> Drawing:
        """Chooses the rows; a ghost is drawn more coarsely."""
        buckets = _GHOST_BUCKETS if is_ghost else _BUCKETS
        return cls(trace, chart, window, rows_to_draw(trace, window, chart.lines, buckets))

    def columns(self, ghost: Drawing | None = None) -> tuple[Values, ...]:
        """Time, slipping (0 or 1), the lines, and the lines of a ghost, of equal length.

        The first and the last point lie exactly on the ends of the window. Beyond its own
        span a ghost is not a number.

        Args:
            ghost: This chart of another run, in this window.
        """
        own = _table(self.trace, self.chart)
        times, values = self._cut(own)
        if ghost is None:
            return (times, *_columns_of(values))
        other = _table(ghost.trace, ghost.chart)
        ghost_times, ghost_values = ghost._cut(other)
        # Rows of equal times are the sides of an event: the ghost's rows come after ours.
        joined = np.concatenate([times, ghost_times])
        order = np.argsort(joined, kind="stable")
        mine, its = rows_from_start(self.trace), rows_from_start(ghost.trace)
        ours = [values, read_rows(self.trace.times[mine], own[mine], ghost_times, "right")]
        theirs = [read_rows(ghost.trace.times[its], other[its], times, "left"), ghost_values]
        solid, pale = (_columns_of(np.concatenate(both)[order]) for both in (ours, theirs))
        return (joined[order], *solid, *pale[1:])

    def _cut(self, values: Values) -> tuple[Values, Values]:
        """Times and values, from one end of the window to the other as far as the run goes."""
        times = self.trace.times
        inside = self.rows[rows_inside(times[self.rows], self.window)]
        before, after = locate(times, self.window.start), locate(times, self.window.end)
        cut_times, cut_values = (
            np.concatenate([[before.read(rows)], rows[inside], [after.read(rows)]])
            for rows in (times, values)
        )
        return cut_times, cut_values


def event_rows(trace: Trace) -> Rows:
    """Rows on either side of an event: two rows that share one time."""
    first = np.flatnonzero(np.diff(trace.times) == 0.0)
    return np.unique(np.concatenate([first, first + 1]))


def is_slipping(trace: Trace) -> NDArray[np.bool_]:
    """Whether any contact slips, one value per row."""
    return (trace.phase != ContactPhase.STICK).any(axis=1)


def rows_inside(times: Values, window: TimeWindow) -> NDArray[np.bool_]:
    """Which of some times are in a window, its ends included."""
    return (times >= window.start) & (times <= window.end)


def rows_to_draw(
    trace: Trace, window: TimeWindow, lines: Sequence[Line], buckets: int = _BUCKETS
) -> Rows:
    """The rows of a window that a chart needs: all of them while they are few.

    Where there are more than a chart can show, each bucket of rows keeps the lowest and
    the highest value of every line, and every row at an event stays: but for a run that
    chatters, whose thousands of events no chart can resolve.

    Args:
        trace: The run.
        window: What the chart shows; one row beyond either end is kept, so that lines reach it.
        lines: The lines of the chart.
        buckets: How many buckets there may be; up to four times as many rows are drawn as is.
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
    """What signals hold at some times, on the straight lines between their rows.

    Args:
        times: Times of their rows, shape ``(rows,)`` [s].
        values: Their values, shape ``(rows, signals)``.
        at: Where to read them, shape ``(n,)`` [s].
        side: Which side of an event counts at its very time: ``left`` is the one before it,
            ``right`` the one after it.

    Returns:
        Shape ``(n, signals)``; not a number where the signals have not begun, or have ended.
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
    """Each column of a table in one piece, as it is sent."""
    return np.ascontiguousarray(values.T)
