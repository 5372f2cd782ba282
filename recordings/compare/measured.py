"""The distance between measured data and a run, or other measured data, signal by signal."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN, Floats
from slipgrasp.recordings.compare.comparison import IncomparableError
from slipgrasp.recordings.measured.recording import MeasuredRecording


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalDistance:
    """Distance of one signal, the other minus the measured one at the measured times.

    Attributes:
        name: Name of the column.
        unit: SI unit of the distances.
        samples: Number of measured samples that both cover.
        mean: Mean difference.
        rms: Root mean square of the difference.
        max: Largest absolute difference.
        time_of_max: When it occurs [s].
    """

    name: str
    unit: str
    samples: int
    mean: float
    rms: float
    max: float
    time_of_max: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Distances:
    """Distances of all signals that both have.

    Attributes:
        signals: Distance by name of the column.
        span: First and last measured time that both cover [s].
        only_measured: Measured signals that the other lacks.
    """

    signals: dict[str, SignalDistance]
    span: tuple[float, float]
    only_measured: tuple[str, ...]

    def within(self, tolerance: float) -> bool:
        """True if no difference exceeds a tolerance, in the SI unit of each signal."""
        return all(signal.max <= tolerance for signal in self.signals.values())

    def to_mapping(self) -> dict[str, Any]:
        """The distances as plain values for JSON (the ``diff --json`` object)."""
        return {"kind": "measured", **asdict(self)}


def measure_distances(
    measured: MeasuredRecording, other: RunResult | MeasuredRecording
) -> Distances:
    """Compares at the measured times; the other is interpolated linearly between its samples.

    Args:
        measured: Measured data.
        other: A run, or other measured data.

    Raises:
        IncomparableError: If they have no signal, or no time, in common.
    """
    times, columns = _columns(other)
    inside = (measured.times >= times[0]) & (measured.times <= times[-1])
    if not inside.any():
        spans = (measured.times[0], measured.times[-1], times[0], times[-1])
        raise IncomparableError(
            "the measured data last from {:.6g} to {:.6g} s, the other recording from {:.6g} to "
            "{:.6g} s; import the data again with --start".format(*spans)
        )
    at = measured.times[inside]
    signals: dict[str, SignalDistance] = {}
    for column in measured.outline.columns:
        if column.name in columns:
            other_values = np.interp(at, times, columns[column.name])
            difference = other_values - measured.column(column.name)[inside]
            signals[column.name] = _distance(column.name, column.unit, at, difference)
    if not signals:
        names = ", ".join(column.name for column in measured.outline.columns)
        message = f"the measured data have {names}, none of which the other recording has"
        raise IncomparableError(message)
    missing = tuple(c.name for c in measured.outline.columns if c.name not in columns)
    return Distances(signals=signals, span=(float(at[0]), float(at[-1])), only_measured=missing)


def _distance(name: str, unit: str, times: Floats, difference: Floats) -> SignalDistance:
    top = int(np.argmax(np.abs(difference)))
    return SignalDistance(
        name=name,
        unit=unit,
        samples=len(difference),
        mean=float(difference.mean()),
        rms=float(np.sqrt(np.mean(difference**2))),
        max=float(abs(difference[top])),
        time_of_max=float(times[top]),
    )


def _columns(other: RunResult | MeasuredRecording) -> tuple[Floats, dict[str, Floats]]:
    if isinstance(other, MeasuredRecording):
        names = [column.name for column in other.outline.columns]
        return other.times, dict(zip(names, other.values.T, strict=True))
    columns = columns_of(other.trace)
    return other.trace.times, {
        c.name: np.asarray(c.values, np.float64) for c in columns if c.name != TIME_COLUMN
    }
