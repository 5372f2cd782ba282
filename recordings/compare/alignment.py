"""Alignment of rows and phase changes of two runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase, PhaseChange

SAME_TIME = 1e-9
"""Times with at most this difference are equal [s]."""

MOST_ALIGNED = 1500
"""Number of phase changes of a contact that are aligned together, which limits the table."""

_SPAN = 1 + max(ContactPhase) - min(ContactPhase)

Times = NDArray[np.float64]
Indices = NDArray[np.intp]
Pair = tuple[PhaseChange | None, PhaseChange | None]


class MatchedRows(NamedTuple):
    """Rows of two traces at common instants.

    Attributes:
        first: Rows of the first trace, in time order.
        second: Corresponding rows of the second trace.
        num_instants: Number of instants; an event has two rows.
    """

    first: Indices
    second: Indices
    num_instants: int


def match_rows(first: Times, second: Times) -> MatchedRows:
    """Finds the instants that both traces contain, without interpolation.

    Of several rows at one instant (an event), the first and the last are used, with the states
    before and after. They are paired with the first and last rows of the other trace, even if it
    has a single row there.

    Args:
        first: Times of one trace, ascending, shape ``(rows,)`` [s].
        second: Times of the other trace.
    """
    mine, others = _Instants.of(first), _Instants.of(second)
    i, j = _mutually_nearest(mine.times, others.times)
    has_two = (mine.first[i] != mine.last[i]) | (others.first[j] != others.last[j])
    order = np.argsort(np.concatenate([np.arange(len(i)), np.flatnonzero(has_two)]), kind="stable")
    pairs = [
        np.concatenate([side.first[k], side.last[k][has_two]])[order]
        for side, k in ((mine, i), (others, j))
    ]
    return MatchedRows(pairs[0], pairs[1], len(i))


class _Instants(NamedTuple):
    """The distinct times of a trace, and the first and last row of each."""

    times: Times
    first: Indices
    last: Indices

    @classmethod
    def of(cls, times: Times) -> _Instants:
        different, first, counts = np.unique(times, return_index=True, return_counts=True)
        return cls(different, first, first + counts - 1)


def _mutually_nearest(first: Times, second: Times) -> tuple[Indices, Indices]:
    """Pairs of equal times that are each other's nearest."""
    there, back = _nearest(first, second), _nearest(second, first)
    i = np.arange(len(first))
    chosen = (back[there] == i) & (np.abs(first - second[there]) <= SAME_TIME)
    return i[chosen], there[chosen]


def _nearest(times: Times, among: Times) -> Indices:
    """Index of the nearest of the other times, for each time."""
    right = np.searchsorted(among, times).clip(1, max(1, len(among) - 1))
    left, right = right - 1, np.minimum(right, len(among) - 1)
    return np.where(times - among[left] <= among[right] - times, left, right)


def match_phase_changes(
    first: Sequence[PhaseChange], second: Sequence[PhaseChange], num_contacts: int
) -> list[Pair]:
    """Pairs the phase changes of two runs, contact by contact.

    The alignment maximizes the number of pairs of equal transitions in order, then minimizes their
    differences in time: a slip in only one of the runs does not shift the following ones.

    Args:
        first: Phase changes of one run, in time order.
        second: Phase changes of the other run.
        num_contacts: Number of contacts of both.

    Returns:
        All phase changes in time order; unpaired if the other run has no corresponding one.
    """
    pairs: list[Pair] = []
    for contact in range(num_contacts):
        mine = [change for change in first if change.contact == contact]
        others = [change for change in second if change.contact == contact]
        for start in range(0, max(len(mine), len(others)), MOST_ALIGNED):
            piece = slice(start, start + MOST_ALIGNED)
            pairs += _align(mine[piece], others[piece])
    return sorted(pairs, key=lambda pair: min(change.time for change in pair if change))


def _align(mine: Sequence[PhaseChange], others: Sequence[PhaseChange]) -> Iterator[Pair]:
    """Traces the best alignment back through the table of all pairs."""
    best = _best_scores(mine, others)
    i, j = len(mine), len(others)
    while i and j:
        if best[i, j] == best[i - 1, j]:
            i -= 1
            yield mine[i], None
        elif best[i, j] == best[i, j - 1]:
            j -= 1
            yield None, others[j]
        else:
            i, j = i - 1, j - 1
            yield mine[i], others[j]
    yield from ((change, None) for change in mine[:i])
    yield from ((None, change) for change in others[:j])


def _best_scores(mine: Sequence[PhaseChange], others: Sequence[PhaseChange]) -> NDArray[np.float64]:
    """Best scores of aligning the first i phase changes of one run with the first j of the other.

    A pair scores 1, minus a penalty for its time difference that stays below 1 in total: more pairs
    are always better.

    Returns:
        The scores, shape ``(len(mine) + 1, len(others) + 1)``.
    """
    best = np.zeros((len(mine) + 1, len(others) + 1))
    kinds = np.array([_kind(change) for change in others], dtype=np.int16)
    times = np.array([c.time for c in others])
    span = max([c.time for c in (*mine, *others)], default=0.0) or 1.0
    for i, change in enumerate(mine):
        apart = np.abs(times - change.time) / (span * (len(mine) + 1))
        same = kinds == _kind(change)
        paired = np.where(same, best[i, :-1] + 1.0 - apart, -np.inf)
        best[i + 1, 1:] = np.maximum.accumulate(np.maximum(paired, best[i, 1:]))
    return best


def _kind(change: PhaseChange) -> int:
    """A unique number for every pair of phases."""
    return _SPAN * change.from_phase + change.to_phase
