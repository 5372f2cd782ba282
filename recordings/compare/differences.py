"""Differences of phase changes and of columns between two runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.compare.accuracy import Accuracy
from slipgrasp.recordings.compare.alignment import MatchedRows, Pair, match_phase_changes


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseDifference:
    """A phase change that moved, or that is in one run only.

    Attributes:
        contact: Index of the contact.
        from_phase: The phase that ends.
        to_phase: The phase that begins.
        a: Its time in the first run, None if absent [s].
        b: Its time in the second run, None if absent [s].
    """

    contact: int
    from_phase: ContactPhase
    to_phase: ContactPhase
    a: float | None
    b: float | None

    @property
    def time_difference(self) -> float | None:
        """Delay of the change in the second run [s]; None if it is in one run only."""
        return None if self.a is None or self.b is None else self.b - self.a


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalDifference:
    """Difference of one column over the compared instants.

    Attributes:
        name: Name of the column.
        signal: The signal of the trace that contains it.
        unit: SI unit.
        max: Largest absolute difference.
        time_of_max: Time of this difference [s].
        rms: Root mean square over time (trapezoidal rule between compared instants).
        tolerance: Tolerance of the column.
        first_divergence: Time at which it first exceeds the tolerance, None if never [s]; not
            before the first cause, unless the user set the tolerance.
        before_cause: Largest difference before the first cause, due to integration errors.
    """

    name: str
    signal: str
    unit: str
    max: float
    time_of_max: float
    rms: float
    tolerance: float
    first_divergence: float | None
    before_cause: float


def phase_differences(a: RunResult, b: RunResult, tolerance: float) -> Iterator[PhaseDifference]:
    """Phase changes that moved by more than the tolerance [s], or are in one run only."""
    contacts = a.trace.shape.num_contacts
    for pair in match_phase_changes(a.phase_changes, b.phase_changes, contacts):
        difference = _phase_difference(pair)
        moved = difference.time_difference
        if moved is None or abs(moved) > tolerance:
            yield difference


def _phase_difference(pair: Pair) -> PhaseDifference:
    mine, other = pair
    change = mine or other
    assert change is not None  # a pair has at least one time
    return PhaseDifference(
        contact=change.contact,
        from_phase=change.from_phase,
        to_phase=change.to_phase,
        a=None if mine is None else mine.time,
        b=None if other is None else other.time,
    )


def signal_differences(
    a: RunResult, b: RunResult, rows: MatchedRows, accuracy: Accuracy
) -> dict[str, SignalDifference]:
    """Differences of all common columns.

    Args:
        a: First run.
        b: Second run.
        rows: Rows at common instants.
        accuracy: Tolerances, and the time of the first cause.
    """
    others = {column.name: column for column in columns_of(b.trace)}
    times = a.trace.times[rows.first]
    pairs = [
        (column, others[column.name])
        for column in columns_of(a.trace)
        if column.name in others and column.name != TIME_COLUMN
    ]
    largest: dict[str, float] = {}
    for pair in pairs:
        for column in pair:
            top = float(np.abs(column.values.astype(float)).max(initial=0.0))
            largest[column.signal] = max(top, largest.get(column.signal, 0.0))
    return {
        mine.name: _signal_difference(
            mine, other, times, rows, accuracy, accuracy.tolerance_of(largest[mine.signal])
        )
        for mine, other in pairs
    }


def _signal_difference(
    a: Column,
    b: Column,
    times: NDArray[np.float64],
    rows: MatchedRows,
    accuracy: Accuracy,
    tolerance: float,
) -> SignalDifference:
    # Numbers in a file may be extremely large: differences are limited.
    largest = np.finfo(np.float64).max
    with np.errstate(over="ignore"):
        apart = np.abs(a.values[rows.first].astype(float) - b.values[rows.second]).clip(0, largest)
    early = accuracy.is_early(times)
    beyond = np.flatnonzero((apart > tolerance) & (accuracy.is_chosen | ~early))
    top = int(np.argmax(apart))
    return SignalDifference(
        name=a.name,
        signal=a.signal,
        unit=a.unit,
        max=float(apart[top]),
        time_of_max=float(times[top]),
        rms=_root_mean_square(apart, times),
        tolerance=tolerance,
        first_divergence=float(times[beyond[0]]) if len(beyond) else None,
        before_cause=float(apart[early].max(initial=0.0)),
    )


def _root_mean_square(values: NDArray[np.float64], times: NDArray[np.float64]) -> float:
    """Root mean square over time, scaled by the largest value to avoid overflow."""
    top = float(values.max())
    if top == 0.0:
        return 0.0
    squares = (values / top) ** 2
    span = times[-1] - times[0]
    mean = squares.mean() if span == 0.0 else np.trapezoid(squares, times) / span
    return min(top, top * math.sqrt(mean))
