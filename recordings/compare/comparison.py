"""Differences between two runs: parameters, events, the first deviation, its size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipgrasp.core.run.claims import Contradiction, contradictions_of
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.parameters import ParameterDifference, parameter_differences
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.frames import import_optional
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.recordings.compare.accuracy import Accuracy
from slipgrasp.recordings.compare.alignment import MatchedRows, match_rows
from slipgrasp.recordings.compare.differences import (
    PhaseDifference,
    SignalDifference,
    phase_differences,
    signal_differences,
)
from slipgrasp.recordings.exceptions import RecordingError

if TYPE_CHECKING:
    import pandas

LEAST_INSTANTS = 2


class IncomparableError(RecordingError):
    """Two runs that have too little in common to be compared."""


class ToleranceError(RecordingError, ValueError):
    """A tolerance that is none."""

    def __init__(self, tolerance: float) -> None:
        super().__init__(f"tolerance is {tolerance}; allowed: a finite number of at least 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegrationError:
    """How far two runs differ before anything that was set does: their steps are others.

    Attributes:
        before: When what was set first differs [s].
        column: The column that differs most, measured by its tolerance.
        max: Its largest difference until then.
        unit: Its SI unit.
    """

    before: float
    column: str
    max: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """Differences between two runs, a and b.

    Attributes:
        tolerance: Absolute difference that the user chose to count as none, in the SI unit of
            each column; None for the accuracy of the integration
            (`slipgrasp.recordings.compare.accuracy`).
        time_tolerance: Difference in time that counts as none [s].
        identical: Whether nothing at all differs; then all lists are empty.
        equal: Whether the same happened: outcome, end time, phase changes and all columns
            agree within the tolerance, and neither run contradicts itself. What was set may
            differ.
        cause: When what was set first differs [s]; None if it never does.
        integration_error: How far the runs differ before; None if they do not.
        contradictions: What the runs state of themselves against their own samples, as ``a`` or
            ``b`` and what.
        scenario: Parameters that differ.
        phase_changes: Phase changes that moved by more than the tolerance, or are not in both.
        signals: Every column that both runs have, by name.
        metrics: Every metric by name: its value in a and in b. Outcome and end time stand
            here too where they differ.
        num_instants: How many instants were compared.
        span: First and last of them [s].
        end_times: When the two runs ended [s].
        only_a: Columns that b does not have: estimates of other unknowns, and what is newer than
            the recording of b.
        only_b: Columns that a does not have.
    """

    tolerance: float | None
    time_tolerance: float
    identical: bool
    equal: bool
    cause: float | None
    integration_error: IntegrationError | None
    contradictions: tuple[tuple[str, Contradiction], ...]
    scenario: tuple[ParameterDifference, ...]
    phase_changes: tuple[PhaseDifference, ...]
    signals: dict[str, SignalDifference]
    metrics: dict[str, tuple[Any, Any]]
    num_instants: int
    span: tuple[float, float]
    end_times: tuple[float, float]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]

    @property
    def first_divergence(self) -> dict[str, float]:
        """When each column first exceeds the tolerance, earliest first [s]."""
        times = {
            name: signal.first_divergence
            for name, signal in self.signals.items()
            if signal.first_divergence is not None
        }
        return dict(sorted(times.items(), key=lambda entry: entry[1]))

    @property
    def largest_differences(self) -> tuple[SignalDifference, ...]:
        """Of each signal the column that differs most, if by more than the tolerance."""
        tops: dict[str, SignalDifference] = {}
        for column in self.signals.values():
            top = tops.get(column.signal)
            if column.max > (column.tolerance if top is None else top.max):
                tops[column.signal] = column
        return tuple(tops.values())

    def to_mapping(self) -> dict[str, Any]:
        """The comparison as plain values for JSON (the ``diff --json`` object)."""
        return {
            "equal": self.equal,
            "scenario": [{"key": d.key, "a": d.a, "b": d.b} for d in self.scenario],
            "phase_changes": [
                {
                    "contact": change.contact,
                    "from": change.from_phase.label,
                    "to": change.to_phase.label,
                    "a": change.a,
                    "b": change.b,
                    "time_difference": change.time_difference,
                }
                for change in self.phase_changes
            ],
            "first_divergence": self.first_divergence,
            "signals": {
                name: {"max": s.max, "rms": s.rms, "tolerance": s.tolerance}
                for name, s in self.signals.items()
            },
            "metrics": {name: {"a": a, "b": b} for name, (a, b) in self.metrics.items()},
            "cause": self.cause,
            "integration_error": self.integration_error and asdict(self.integration_error),
            "contradictions": [{"run": run, **asdict(found)} for run, found in self.contradictions],
        }

    def to_pandas(self) -> pandas.DataFrame:
        """The columns as a table by name: signal, unit, max, time_of_max, rms, first_divergence.

        Raises:
            MissingPackageError: If pandas is not installed.
        """
        names = [name for name in SignalDifference.__dataclass_fields__ if name != "name"]
        rows = {name: asdict(signal) for name, signal in self.signals.items()}
        frame = import_optional("pandas").DataFrame.from_dict(rows, orient="index", columns=names)
        return frame.rename_axis("name").astype({"first_divergence": float})


def compare(
    a: RunResult, b: RunResult, tolerance: float | None = None, *, check_claims: bool = True
) -> Comparison:
    """Compares two runs.

    The runs are compared at the instants that both stored, without interpolation, so runs
    stored at different rates meet where their rates do; runs of different lengths are
    compared as far as both go.

    Args:
        a: One run, live or recorded.
        b: The other.
        tolerance: Absolute difference that counts as none, in the SI unit of each column; the
            accuracy of the integration if None.
        check_claims: Whether what the runs state is compared with their samples, which have to be
            all of them.

    Raises:
        IncomparableError: If one hand is planar and the other spatial, if they have different
            numbers of fingers, or if fewer than two instants were stored in both runs.
        ToleranceError: If the tolerance is negative or not finite.
    """
    if tolerance is not None:
        check_tolerance(tolerance)
    _check_hands(a, b)
    rows = _check_instants(match_rows(a.trace.times, b.trace.times), a, b)
    times = a.trace.times[rows.first]
    accuracy = Accuracy.between(a, b, tolerance)
    contradictions = tuple(_contradictions(a, b)) if check_claims else ()
    identical = _are_identical(a, b)
    changes = () if identical else tuple(phase_differences(a, b, accuracy.of_times))
    signals = {} if identical else signal_differences(a, b, rows, accuracy)
    return Comparison(
        tolerance=tolerance,
        time_tolerance=accuracy.of_times,
        identical=identical,
        equal=a.outcome is b.outcome
        and abs(a.end_time - b.end_time) <= accuracy.of_times
        and not (changes or contradictions)
        and all(signal.first_divergence is None for signal in signals.values()),
        cause=accuracy.cause,
        integration_error=_integration_error(accuracy.cause, signals.values()),
        contradictions=contradictions,
        scenario=tuple(parameter_differences(a.scenario, b.scenario)),
        phase_changes=changes,
        signals=signals,
        metrics={} if identical else _metrics(a, b),
        num_instants=rows.num_instants,
        span=(float(times[0]), float(times[-1])),
        end_times=(a.end_time, b.end_time),
        only_a=_names_missing(a, b),
        only_b=_names_missing(b, a),
    )


def _contradictions(a: RunResult, b: RunResult) -> Iterator[tuple[str, Contradiction]]:
    for name, run in (("a", a), ("b", b)):
        yield from ((name, found) for found in contradictions_of(run))


def _integration_error(
    cause: float | None, signals: Iterable[SignalDifference]
) -> IntegrationError | None:
    differing = [signal for signal in signals if signal.before_cause > 0.0]
    if cause is None or not differing:
        return None
    top = max(differing, key=lambda s: s.before_cause / max(s.tolerance, np.finfo(float).tiny))
    return IntegrationError(before=cause, column=top.name, max=top.before_cause, unit=top.unit)


def check_tolerance(tolerance: float) -> float:
    """The tolerance, if it is one.

    Raises:
        ToleranceError: If it is negative or not finite.
    """
    if not (math.isfinite(tolerance) and tolerance >= 0.0):
        raise ToleranceError(tolerance)
    return tolerance


def _check_hands(a: RunResult, b: RunResult) -> None:
    if a.scenario.space is not b.scenario.space:
        # Columns of one name are other quantities: y points upwards in the plane, z in space.
        raise IncomparableError(
            "a planar and a spatial hand cannot be compared, their coordinates and joints are "
            "different ones; choose two runs of planar hands or two of spatial hands"
        )
    counts = a.trace.shape.num_contacts, b.trace.shape.num_contacts
    if counts[0] != counts[1]:
        raise IncomparableError(
            f"hands of {counts[0]} and {counts[1]} fingers cannot be compared; "
            "choose runs of hands with equally many fingers"
        )


def _check_instants(rows: MatchedRows, a: RunResult, b: RunResult) -> MatchedRows:
    is_single = all(len(np.unique(run.trace.times)) == 1 for run in (a, b))
    if rows.num_instants >= LEAST_INSTANTS or (rows.num_instants == 1 and is_single):
        return rows
    found = ("no instant", "only one instant")[rows.num_instants]
    raise IncomparableError(
        f"the runs have {found} in common, too little to compare them; simulate both "
        "with the same simulation.output_rate, and until after the start"
    )


def _are_identical(a: RunResult, b: RunResult) -> bool:
    return (
        a.trace.shape == b.trace.shape
        and (a.scenario, a.outcome, a.reason) == (b.scenario, b.outcome, b.reason)
        and (a.phase_changes, a.warnings, a.metrics) == (b.phase_changes, b.warnings, b.metrics)
        and all(np.array_equal(getattr(a.trace, s.name), getattr(b.trace, s.name)) for s in SIGNALS)
    )


def _metrics(a: RunResult, b: RunResult) -> dict[str, tuple[Any, Any]]:
    metrics = asdict(a.metrics), asdict(b.metrics)
    pairs = {name: (metrics[0][name], metrics[1][name]) for name in metrics[0]}
    ends = {
        "outcome": (a.outcome.value, b.outcome.value),
        "end_time": (a.end_time, b.end_time),
    }
    return {name: ends[name] for name in ends if ends[name][0] != ends[name][1]} | pairs


def _names_missing(run: RunResult, other: RunResult) -> tuple[str, ...]:
    names = {column.name for column in columns_of(other.trace)}
    return tuple(c.name for c in columns_of(run.trace) if c.name not in names)
