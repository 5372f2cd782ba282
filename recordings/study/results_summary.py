"""Summary of a study: numbers of runs by outcome, and statistics of the metrics."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.study.knowledge import knowledge_in
from slipgrasp.recordings.study.result_table import ResultTable

_SHARES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""Fractions of the quantiles of `Spread`, in its order."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Statistics of a metric, in its unit.

    Attributes:
        runs: Number of runs with a value.
        minimum: Smallest value.
        percentile_5: 5th percentile.
        percentile_25: 25th percentile.
        median: Median.
        percentile_75: 75th percentile.
        percentile_95: 95th percentile.
        maximum: Largest value.
    """

    runs: int
    minimum: float
    percentile_5: float
    percentile_25: float
    median: float
    percentile_75: float
    percentile_95: float
    maximum: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StudySummary:
    """Summary of a study.

    Attributes:
        runs: Number of runs.
        finished: Number of finished runs.
        outcomes: Number of runs by outcome, the most frequent first.
        reasons: Number of early ends by code of the reason.
        held: Number of runs that held the object at the end.
        too_short: Number of completed runs that are too short to decide whether they held it.
        share_held: Fraction of the other finished runs that held it; 0 if there are none.
        unknowns: Keys of the parameters that were unknown to the controller of any run.
        told: Whether all parameters were known in all runs.
        metrics: Statistics of each metric over all finished runs.
        metrics_by_outcome: Statistics of each metric by outcome.
    """

    runs: int
    finished: int
    outcomes: dict[str, int]
    reasons: dict[str, int]
    held: int
    too_short: int
    share_held: float
    unknowns: tuple[str, ...]
    told: bool
    metrics: dict[str, Spread]
    metrics_by_outcome: dict[str, dict[str, Spread]]


def summarize(results: ResultTable) -> StudySummary:
    """Counts the outcomes, and computes statistics of the metrics."""
    count, words = results.num_rows, results.values("outcome")
    outcomes = dict(Counter(words).most_common())
    held = int(np.count_nonzero(results.numbers("held") == 1.0))
    too_short = int(np.count_nonzero(results.too_short()))
    metrics = {
        column.name: results.numbers(column.name)
        for column in results.columns
        if column.role == "metric" and column.kind != "boolean"
    }
    places, known = np.array(words, dtype=np.str_), knowledge_in(results.study)
    return StudySummary(
        runs=results.study.num_runs,
        finished=count,
        outcomes=outcomes,
        reasons=dict(Counter(filter(None, results.values("reason"))).most_common()),
        held=held,
        too_short=too_short,
        share_held=held / max(1, count - too_short),
        unknowns=known.unknowns,
        told=known.told,
        metrics=_spreads(metrics, np.ones(count, dtype=bool)),
        metrics_by_outcome={word: _spreads(metrics, places == word) for word in outcomes},
    )


def _spreads(metrics: dict[str, NDArray[np.float64]], rows: NDArray[np.bool_]) -> dict[str, Spread]:
    spreads = {name: spread_of(values[rows]) for name, values in metrics.items()}
    return {name: spread for name, spread in spreads.items() if spread is not None}


def spread_of(values: NDArray[np.float64]) -> Spread | None:
    """Statistics of the numeric values; None if there are none."""
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    return Spread(len(known), *np.quantile(known, _SHARES).tolist())
