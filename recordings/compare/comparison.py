"""Differences between two runs: parameters, events, the first deviation, its size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipgrasp.core.run.claims import Contradiction, contradictions_of
from slipgrasp.core.run.metrics import METRICS
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import RAIL, SUPPORT
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
    """Runs that differ too much to be compared."""


class ToleranceError(RecordingError, ValueError):
    """An invalid tolerance."""

    def __init__(self, tolerance: float) -> None:
        super().__init__(f"tolerance is {tolerance}; allowed: a finite number of at least 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegrationError:
    """Difference between two runs before the first effect of different parameters.

    Attributes:
        before: Time of the first effect of different parameters [s].
        column: The column with the largest difference relative to its tolerance.
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
        tolerance: Absolute tolerance from the user, in the SI unit of each column; None for the
            accuracy of the integration (`slipgrasp.recordings.compare.accuracy`).
        time_tolerance: Tolerance of times [s].
        identical: Whether nothing differs; then the lists of differences are empty.
        equal: Whether outcome, end time, phase changes and all columns agree within the tolerance,
            and neither run contradicts itself. Parameters may differ.
        cause: Time of the first effect of different parameters [s]; None if there is none.
        integration_error: Difference of the runs before that time; None if there is none.
        contradictions: Stated results that contradict the samples, with the run, ``a`` or ``b``.
        scenario: Differing parameters.
        phase_changes: Phase changes that moved by more than the tolerance, or are in one run only.
        signals: Every common column, by name.
        metrics: Every metric by name: its values in a and in b, and outcome and end time if they
            differ.
        num_instants: Number of compared instants.
        span: First and last of them [s].
        end_times: End times of the two runs [s].
        only_a: Columns missing in b: estimates of other unknowns, and signals newer than the
            recording of b.
        only_b: Columns missing in a.
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
        """Time at which each column first exceeds the tolerance, earliest first [s]."""
        times = {
            name: signal.first_divergence
            for name, signal in self.signals.items()
            if signal.first_divergence is not None
        }
        return dict(sorted(times.items(), key=lambda entry: entry[1]))

    @property
    def largest_differences(self) -> tuple[SignalDifference, ...]:
        """For each signal, the column with the largest difference beyond the tolerance."""
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

    The runs are compared at the instants that both contain, without interpolation; runs of
    different lengths are compared up to the end of the shorter one.

    Args:
        a: First run, live or recorded.
        b: Second run.
        tolerance: Absolute tolerance, in the SI unit of each column; the accuracy of the
            integration if None.
        check_claims: Whether to check stated results against the samples, which must then be
            complete.

    Raises:
        IncomparableError: If the kinds of scenario or the numbers of fingers differ, or if fewer
            than two instants are common (one, if each run has only one).
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
    """Validates the tolerance.

    Raises:
        ToleranceError: If it is negative or not finite.
    """
    if not (math.isfinite(tolerance) and tolerance >= 0.0):
        raise ToleranceError(tolerance)
    return tolerance


_KINDS = {SUPPORT: "a body on a support", RAIL: "a body on a rail"}


def _check_hands(a: RunResult, b: RunResult) -> None:
    alike = a.scenario.space is b.scenario.space
    if not (alike or (a.scenario.space.has_hand and b.scenario.space.has_hand)):
        kinds = " and ".join(_KINDS.get(each.scenario.space, "a hand") for each in (a, b))
        raise IncomparableError(f"{kinds} cannot be compared; choose two runs of the same kind")
    if a.scenario.space is not b.scenario.space:
        # Equal names have different meanings: y points up for planar hands, z for spatial ones.
        raise IncomparableError(
            "a planar and a spatial hand cannot be compared, because their coordinates and joints "
            "differ; choose two runs of planar hands or two of spatial hands"
        )
    counts = a.trace.shape.num_contacts, b.trace.shape.num_contacts
    if counts[0] != counts[1]:
        raise IncomparableError(
            f"hands of {counts[0]} and {counts[1]} fingers cannot be compared; "
            "choose runs of hands with the same number of fingers"
        )


def _check_instants(rows: MatchedRows, a: RunResult, b: RunResult) -> MatchedRows:
    is_single = all(len(np.unique(run.trace.times)) == 1 for run in (a, b))
    if rows.num_instants >= LEAST_INSTANTS or (rows.num_instants == 1 and is_single):
        return rows
    found = ("no instant", "only one instant")[rows.num_instants]
    raise IncomparableError(
        f"the runs have {found} in common, which is not enough for a comparison; simulate both "
        "with the same simulation.output_rate, and beyond the start"
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
    has_control = a.scenario.space.has_control
    names = [metric.name for metric in METRICS if has_control or not metric.of_control]
    pairs = {name: (metrics[0][name], metrics[1][name]) for name in names}
    ends = {
        "outcome": (a.outcome.value, b.outcome.value),
        "end_time": (a.end_time, b.end_time),
    }
    return {name: ends[name] for name in ends if ends[name][0] != ends[name][1]} | pairs


def _names_missing(run: RunResult, other: RunResult) -> tuple[str, ...]:
    names = {column.name for column in columns_of(other.trace)}
    return tuple(c.name for c in columns_of(run.trace) if c.name not in names)
