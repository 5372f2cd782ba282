"""The results of a study in numbers: how many runs ended how, and how the metrics are spread."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.study.knowledge import knowledge_in
from slipgrasp.recordings.study.result_table import ResultTable

_SHARES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """How the values of a metric are spread, in its unit.

    Attributes:
        runs: How many runs have a value.
        minimum: The least.
        percentile_5: What a twentieth of them do not exceed.
        percentile_25: What a quarter of them do not exceed.
        median: What half of them do not exceed.
        percentile_75: What three quarters of them do not exceed.
        percentile_95: What all but a twentieth of them do not exceed.
        maximum: The largest.
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
    """A study in numbers.

    Attributes:
        runs: How many runs it has.
        finished: How many of them have ended.
        outcomes: How many have each outcome, the most frequent first.
        reasons: How many ended early for which reason, by its code.
        held: How many held the object at the end.
        too_short: How many are completed but too short to tell whether they held it.
        share_held: Those that held it as a share of the others that have ended; 0 if none has.
        unknowns: Keys of the parameters that were unknown to the controller of some run.
        told: Whether nothing was unknown to any of them.
        metrics: Spread of each metric over all that have ended.
        metrics_by_outcome: Spread of each metric over those with each outcome.
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
    """Counts the outcomes and finds the spread of the metrics."""
    count = results.num_rows
    words = results.values("outcome", 0, count)
    reasons = results.values("reason", 0, count)
    outcomes = dict(Counter(words).most_common())
    held = int(np.count_nonzero(results.numbers("held", count) == 1.0))
    too_short = int(np.count_nonzero(results.too_short(count)))
    metrics = {
        column.name: results.numbers(column.name, count)
        for column in results.columns
        if column.role == "metric" and column.kind != "boolean"
    }
    places, known = np.array(words, dtype=np.str_), knowledge_in(results.study)
    return StudySummary(
        runs=results.study.num_runs,
        finished=count,
        outcomes=outcomes,
        reasons=dict(Counter(code for code in reasons if code is not None).most_common()),
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
    """The spread of the values that are numbers; None if there is none."""
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    low, p5, p25, median, p75, p95, high = np.quantile(known, _SHARES).tolist()
    return Spread(
        runs=len(known),
        minimum=low,
        percentile_5=p5,
        percentile_25=p25,
        median=median,
        percentile_75=p75,
        percentile_95=p95,
        maximum=high,
    )
