"""Comparison of crossed values: results of each combination on the same samples."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.recordings.study.map_axes import compared_keys
from slipgrasp.recordings.study.result_table import ResultTable
from slipgrasp.recordings.study.results_summary import spread_of

_UNKNOWN = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """Results of one combination of the crossed values.

    Attributes:
        values: The values by dotted key.
        runs: Number of finished runs with them.
        held: Number of these that held the object at the end.
        too_short: Number of completed runs that are too short to decide whether they held it.
        share_held: Fraction of the other finished runs that held it; 0 if there are none.
        outcomes: Number of runs by outcome, the most frequent first.
        medians: Median of each metric over the runs that have it.
    """

    values: dict[str, Any]
    runs: int
    held: int
    too_short: int
    share_held: float
    outcomes: dict[str, int]
    medians: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class CombinationPair:
    """Two combinations on the samples that are finished and long enough with both.

    Attributes:
        first: Index of the first combination.
        second: Index of the second combination.
        samples: Number of these samples.
        held_by_both: Number of samples on which both held the object.
        held_by_first: Number of samples on which only the first held it.
        held_by_second: Number of samples on which only the second held it.
        held_by_neither: Number of samples on which neither held it.
    """

    first: int
    second: int
    samples: int
    held_by_both: int
    held_by_first: int
    held_by_second: int
    held_by_neither: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CombinationComparison:
    """Combinations of crossed values, and pairs of them on the same samples.

    Attributes:
        keys: Compared keys.
        combinations: All combinations.
        pairs: All pairs of combinations.
    """

    keys: tuple[str, ...]
    combinations: tuple[Combination, ...]
    pairs: tuple[CombinationPair, ...]


def compare_combinations(
    results: ResultTable, keys: tuple[str, ...] | None = None
) -> CombinationComparison | None:
    """Compares the values of some keys with everything else equal.

    Args:
        results: The results, which do not grow.
        keys: Crossed keys; if None, those that are not axes of the map.

    Returns:
        The comparison; None if nothing is crossed, or too many values are.
    """
    chosen = compared_keys(results.study) if keys is None else keys
    if not chosen:
        return None
    held = results.numbers("held") == 1.0
    codes = np.where(results.too_short(), _UNKNOWN, held)
    grouped = rows_by_combination(results, chosen)
    places = np.zeros(len(held), dtype=np.intp)
    for place, (_, rows) in enumerate(grouped):
        places[rows] = place
    samples = _sample_of_rows(results, chosen)
    table = _held_by_sample(samples, places, codes, len(grouped))
    return CombinationComparison(
        keys=chosen,
        combinations=tuple(_combination(results, values, rows, codes) for values, rows in grouped),
        pairs=tuple(_pair(table, *pair) for pair in combinations(range(len(grouped)), 2)),
    )


def rows_by_combination(
    results: ResultTable, keys: tuple[str, ...]
) -> list[tuple[dict[str, Any], NDArray[np.intp]]]:
    """The rows of each combination of crossed values.

    Args:
        results: The results, which do not grow.
        keys: Crossed keys.

    Returns:
        Each combination, as plain values by key, with its rows.
    """
    axes = {axis.key: axis.values or () for axis in results.study.axes}
    offered = list(product(*(map(_plain, axes[key]) for key in keys)))
    members: dict[str, list[int]] = {repr(values): [] for values in offered}
    columns = [results.values(key) for key in keys]
    for row, values in enumerate(zip(*columns, strict=True)):
        members[repr(values)].append(row)
    return [
        (dict(zip(keys, values, strict=True)), np.array(members[repr(values)], dtype=np.intp))
        for values in offered
    ]


def _sample_of_rows(results: ResultTable, keys: tuple[str, ...]) -> NDArray[np.intp]:
    """A number per row that is equal if all but the compared keys are equal; shape ``(rows,)``."""
    others = [key for key in results.study.keys if key not in keys]
    columns = [results.values(key) for key in ("sample", *others)]
    known: dict[str, int] = {}
    cells = zip(*columns, strict=True)
    return np.array([known.setdefault(repr(row), len(known)) for row in cells], dtype=np.intp)


def _held_by_sample(
    samples: NDArray[np.intp], places: NDArray[np.intp], codes: NDArray[np.int_], num: int
) -> NDArray[np.int8]:
    """Whether each combination held on each sample, shape ``(samples, combinations)``."""
    table = np.full((int(samples.max(initial=-1)) + 1, num), _UNKNOWN, dtype=np.int8)
    table[samples, places] = codes
    return table


def _combination(
    results: ResultTable,
    values: dict[str, Any],
    rows: NDArray[np.intp],
    codes: NDArray[np.int_],
) -> Combination:
    words = results.values("outcome")
    medians: dict[str, float] = {}
    for column in results.columns:
        if column.role == "metric" and column.kind != "boolean":
            spread = spread_of(results.numbers(column.name)[rows])
            if spread is not None:
                medians[column.name] = spread.median
    num_held = int(np.count_nonzero(codes[rows] == 1))
    too_short = int(np.count_nonzero(codes[rows] == _UNKNOWN))
    return Combination(
        values=values,
        runs=len(rows),
        held=num_held,
        too_short=too_short,
        share_held=num_held / max(1, len(rows) - too_short),
        outcomes=dict(Counter(words[row] for row in rows.tolist()).most_common()),
        medians=medians,
    )


def _pair(table: NDArray[np.int8], first: int, second: int) -> CombinationPair:
    ended = (table[:, first] != _UNKNOWN) & (table[:, second] != _UNKNOWN)
    one, other = table[ended, first] == 1, table[ended, second] == 1
    return CombinationPair(
        first=first,
        second=second,
        samples=int(np.count_nonzero(ended)),
        held_by_both=int(np.count_nonzero(one & other)),
        held_by_first=int(np.count_nonzero(one & ~other)),
        held_by_second=int(np.count_nonzero(~one & other)),
        held_by_neither=int(np.count_nonzero(~one & ~other)),
    )


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
