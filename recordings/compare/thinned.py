"""Two long recordings with the samples that a figure needs, in memory that does not grow.

Both are read side by side in bins of time. Of each bin remain its first and last sample and the
samples at which a column of either run, or their difference, is least or greatest. Every event and
every slip, with as much time after it, keeps all its samples as long as there are not more of them
than `MOST_OF_EVENTS`.
What remains of one run remains of the other at the same instant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, PhaseChange
from slipgrasp.recordings.compare.alignment import match_rows
from slipgrasp.recordings.file.pieces import Piece, joined, read_pieces
from slipgrasp.recordings.file.size import RecordingSize

MOST_OF_EVENTS = 20_000
"""Samples at events, in slips and after them that a run keeps."""

NUM_BINS = 500
"""More points than are visible in an overview of the width of a page."""

Marks = NDArray[np.bool_]


def read_thinned(
    paths: tuple[Path, Path],
    sizes: tuple[RecordingSize, RecordingSize],
    signals: frozenset[str],
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[RunResult, RunResult]:
    """Reads two recordings side by side and keeps what a figure needs.

    Args:
        paths: The recordings.
        sizes: Their sizes.
        signals: The signals that are drawn; all others are absent.
        should_stop: Asked again and again whether nobody needs it any more.

    Raises:
        RecordingError: If one of them cannot be read.
    """
    wanted = signals | {"phase"}
    a, b = (_Thinning(read_pieces(path, wanted, should_stop)) for path in paths)
    if sizes[0].samples < sizes[1].samples:
        b, a = _thin(b, a, sizes[1])
    else:
        a, b = _thin(a, b, sizes[0])
    return a.result(), b.result()


def _thin(longer: _Thinning, other: _Thinning, size: RecordingSize) -> tuple[_Thinning, _Thinning]:
    count = -(-size.samples // NUM_BINS)
    while True:
        mine = longer.next_rows(count)
        theirs = other.next_rows(2 * count, float(mine.times[-1]) if len(mine) else np.inf)
        if len(mine) == len(theirs) == 0:
            return longer, other
        marks = longer.marks(mine), other.marks(theirs)
        if len(mine) and len(theirs):
            first, second, _ = match_rows(mine.times, theirs.times)
            marks[0][first] |= _extremes(_differences(mine[first], theirs[second]))
            marks[1][second] |= marks[0][first]
            marks[0][first] |= marks[1][second]
        longer.keep(mine[np.flatnonzero(marks[0])])
        other.keep(theirs[np.flatnonzero(marks[1])])


class _Thinning:
    """One of the recordings: what was read and is not thinned yet, and what is kept."""

    def __init__(self, pieces: Iterator[Piece]) -> None:
        self._pieces = pieces
        self._last = next(pieces)
        self._waiting = self._last.trace
        self._changes: list[PhaseChange] = list(self._last.phase_changes)
        self._kept: list[Trace] = []
        self._left = MOST_OF_EVENTS
        self._slip_began = self._close_until = -np.inf

    def next_rows(self, most: int, until: float = np.inf) -> Trace:
        """The next samples up to a time, all of an instant or none."""
        while len(self._waiting) <= most and self._waiting_until(until):
            piece = next(self._pieces, None)
            if piece is None:
                break
            self._last = piece
            self._changes += piece.phase_changes
            self._waiting = joined([self._waiting, piece.trace])
        times = self._waiting.times
        count = int(np.searchsorted(times, until, side="right"))
        if count > most:
            count = int(np.searchsorted(times, times[most - 1], side="right"))
        rows, self._waiting = self._waiting[:count], self._waiting[count:]
        return rows

    def _waiting_until(self, until: float) -> bool:
        return len(self._waiting) == 0 or bool(self._waiting.times[-1] <= until)

    def marks(self, rows: Trace) -> Marks:
        """Which samples of a bin remain for the sake of this run alone."""
        if len(rows) == 0:
            return np.zeros(0, bool)
        same = np.flatnonzero(np.diff(rows.times) == 0.0)
        events = self._close_to_slips(rows)
        events[same] = events[same + 1] = True
        events &= np.cumsum(events) <= self._left
        self._left -= int(events.sum())
        events[[0, -1]] = True
        return events | _extremes([column.values for column in columns_of(rows)])

    def _close_to_slips(self, rows: Trace) -> Marks:
        """In a slip, or as long after one as it took."""
        times, close = rows.times, rows.times <= self._close_until
        slips = np.flatnonzero((rows.phase != ContactPhase.STICK).any(axis=1))
        for slip in np.split(slips, 1 + np.flatnonzero(np.diff(slips) > 1)) if len(slips) else ():
            if slip[0] > 0 or self._close_until == -np.inf:
                self._slip_began = times[slip[0]]
            self._close_until = 2.0 * times[slip[-1]] - self._slip_began
            close |= (times >= times[slip[0]]) & (times <= self._close_until)
        return close

    def keep(self, rows: Trace) -> None:
        """Takes what remains of a bin."""
        self._kept.append(rows)

    def result(self) -> RunResult:
        """The run of what remains."""
        return self._last.run_of(joined(self._kept), tuple(self._changes))


def _differences(a: Trace, b: Trace) -> list[NDArray[Any]]:
    others = {column.name: column.values for column in columns_of(b)}
    return [
        column.values - others[column.name].astype(float)
        for column in columns_of(a)
        if column.name in others and column.name != TIME_COLUMN
    ]


def _extremes(columns: Sequence[NDArray[Any]]) -> Marks:
    """Where any of the columns is least or greatest."""
    marks = np.zeros(len(columns[0]) if columns else 0, bool)
    for values in columns if len(marks) else ():
        marks[[np.argmin(values), np.argmax(values)]] = True
    return marks
