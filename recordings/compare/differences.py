"""The single differences between two runs: of phase changes and of columns."""

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
    """A phase change that moved, or that only one run has.

    Attributes:
        contact: Index of the contact.
        from_phase: The phase that ends.
        to_phase: The phase that begins.
        a: When in the first run, None if not at all [s].
        b: When in the second run [s].
    """

    contact: int
    from_phase: ContactPhase
    to_phase: ContactPhase
    a: float | None
    b: float | None

    @property
    def time_difference(self) -> float | None:
        """How much later it is in the second run [s]; None if only one has it."""
        return None if self.a is None or self.b is None else self.b - self.a


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalDifference:
    """How far one column differs over the compared instants.

    Attributes:
        name: Name of the column.
        signal: The signal of the trace it belongs to.
        unit: SI unit.
        max: Largest absolute difference.
        time_of_max: When it is reached [s].
        rms: Root of the mean square over time (trapezoidal rule between compared instants).
        tolerance: Difference that counts as none.
        first_divergence: When it first exceeds the tolerance, None if never [s]; not before the
            first cause, unless the user chose the tolerance.
        before_cause: Largest difference before the first cause, which nothing but the
            integration makes.
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
    """The phase changes that moved by more than the tolerance [s], or are not in both runs."""
    contacts = a.trace.shape.num_contacts
    for pair in match_phase_changes(a.phase_changes, b.phase_changes, contacts):
        difference = _phase_difference(pair)
        moved = difference.time_difference
        if moved is None or abs(moved) > tolerance:
            yield difference


def _phase_difference(pair: Pair) -> PhaseDifference:
    mine, other = pair
    change = mine or other
    assert change is not None  # a pair has at least one
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
    """How far each column that both runs have differs.

    Args:
        a: One run.
        b: The other.
        rows: Rows at the same instants.
        accuracy: What counts as no difference, and when.
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
    # Numbers from a file may be as large as numbers get: differences end there too.
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
    """Over time; the largest value is taken out first, so that no square is too large."""
    top = float(values.max())
    if top == 0.0:
        return 0.0
    squares = (values / top) ** 2
    span = times[-1] - times[0]
    mean = squares.mean() if span == 0.0 else np.trapezoid(squares, times) / span
    return min(top, top * math.sqrt(mean))
