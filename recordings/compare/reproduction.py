"""Comparison of a recorded run with a new simulation, bit for bit or within a tolerance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipgrasp.core.run.metrics import Metrics, metrics_of_trace
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome, PhaseChange
from slipgrasp.recordings.compare.alignment import match_rows

SAMPLE_TOLERANCE = 1e-8
"""Largest difference of a column until the first phase change after the start [SI]."""

TIME_TOLERANCE = 1e-6
"""Largest difference in time of a phase change, and of the end [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mismatch:
    """A difference between a recording and its new simulation.

    Attributes:
        what: Name of the column, or ``phase_changes``, ``samples``, ``outcome``,
            ``end_time``, ``reason``, ``warnings`` or ``metrics``.
        time: Simulation time, None if it concerns the whole run [s].
        recorded: Recorded value.
        computed: New value.
    """

    what: str
    time: float | None
    recorded: Any
    computed: Any


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunPair:
    """A recorded run and its new simulation.

    Attributes:
        recorded: The recorded run.
        computed: The new simulation; if ``whole`` is false, at least as long as the recorded part,
            unless it ends earlier.
        whole: Whether the recorded run was not stopped early.
    """

    recorded: RunResult
    computed: RunResult
    whole: bool

    @property
    def both_ended(self) -> bool:
        """Whether both runs ended; the simulation of a longer one is stopped."""
        return self.whole and self.computed.outcome is not Outcome.STOPPED

    @property
    def computed_changes(self) -> tuple[PhaseChange, ...]:
        """The phase changes that the recorded run should contain."""
        changes, count = self.computed.phase_changes, len(self.recorded.phase_changes)
        if self.whole:
            return changes
        # The last of simultaneous phase changes may not be recorded.
        limit = self.recorded.end_time - TIME_TOLERANCE
        return changes[:count] + tuple(c for c in changes[count:] if c.time < limit)


def find_bit_mismatches(pair: RunPair) -> Iterator[Mismatch]:
    """Finds every column, phase change and metric that is not equal to the last bit.

    Args:
        pair: The runs.

    Yields:
        Columns first, in the order of their first differences.
    """
    yield from _count_mismatch(pair)
    yield from _column_mismatches(pair)
    yield from _change_mismatches(pair, tolerance=0.0)
    recorded, computed = pair.recorded, pair.computed
    if pair.both_ended:
        yield from _unequal("outcome", recorded.outcome.value, computed.outcome.value)
        yield from _unequal("reason", recorded.reason, computed.reason)
        yield from _unequal("warnings", recorded.warnings, computed.warnings)
    elif not pair.whole and recorded.outcome in (Outcome.STOPPED, Outcome.LIMIT):
        yield from _unequal("outcome", "cut short", _how_far(pair))
    expected = _expected_metrics(pair)
    if expected is not None:
        yield from _unequal("metrics", recorded.metrics, expected)


def find_mismatches(pair: RunPair) -> Iterator[Mismatch]:
    """Finds differences beyond the tolerance between versions and machines.

    Columns must agree within `SAMPLE_TOLERANCE` until the first phase change after the start; phase
    changes must have the same order and agree within `TIME_TOLERANCE`; outcome and end must agree.

    Args:
        pair: The runs.

    Yields:
        Columns first, in the order of their first differences.
    """
    yield from _time_mismatch(pair)
    yield from _differing_columns(pair)
    yield from _change_mismatches(pair, tolerance=TIME_TOLERANCE)
    recorded, computed = pair.recorded, pair.computed
    if pair.both_ended:
        yield from _unequal("outcome", recorded.outcome.value, computed.outcome.value)
    too_early = computed.end_time < recorded.end_time - TIME_TOLERANCE
    too_late = pair.whole and computed.end_time > recorded.end_time + TIME_TOLERANCE
    if too_early or too_late:
        yield from _unequal("end_time", recorded.end_time, computed.end_time)


def _count_mismatch(pair: RunPair) -> Iterator[Mismatch]:
    recorded, computed = len(pair.recorded.trace), len(pair.computed.trace)
    if computed < recorded or (pair.whole and computed > recorded):
        end = min(pair.recorded.end_time, pair.computed.end_time)
        said = computed if computed < recorded else f"more than {recorded}"
        yield Mismatch(what="samples", time=end, recorded=recorded, computed=said)


def _column_mismatches(pair: RunPair) -> list[Mismatch]:
    """The first differing bits of each column, in time order."""
    count = min(len(pair.recorded.trace), len(pair.computed.trace))
    recorded, computed = pair.recorded.trace[:count], pair.computed.trace[:count]
    times = recorded.times
    found: list[Mismatch] = []
    for mine, other in _pairs(recorded, computed):
        rows = np.flatnonzero((_bytes_of(mine) != _bytes_of(other)).any(axis=1))
        if len(rows):
            found.append(_mismatch(mine, other, float(times[rows[0]]), int(rows[0]), int(rows[0])))
    return sorted(found, key=lambda mismatch: mismatch.time or 0.0)


def _pairs(recorded: Trace, computed: Trace) -> Iterator[tuple[Column, Column]]:
    """Pairs of every recorded column and its newly computed one."""
    others = {column.name: column for column in columns_of(computed)}
    return ((column, others[column.name]) for column in columns_of(recorded))


def _bytes_of(column: Column) -> np.ndarray:
    values = np.ascontiguousarray(column.values)
    return values.view(np.uint8).reshape(len(values), values.itemsize)


def _time_mismatch(pair: RunPair) -> Iterator[Mismatch]:
    """The first recorded time without a computed sample, during smooth motion."""
    times, computed = pair.recorded.trace.times, pair.computed.trace.times
    matched = times[match_rows(times, computed).first]
    alone = times[(times < _first_switch(pair)) & ~np.isin(times, matched)]
    if len(alone):
        time = float(alone[0])
        nearest = computed[np.argmin(np.abs(computed - time))]
        yield Mismatch(what=TIME_COLUMN, time=time, recorded=time, computed=float(nearest))


def _differing_columns(pair: RunPair) -> list[Mismatch]:
    """The first difference beyond the tolerance in each column, in time order."""
    recorded, computed = pair.recorded, pair.computed
    rows = match_rows(recorded.trace.times, computed.trace.times)
    times = recorded.trace.times[rows.first]
    smooth = times < _first_switch(pair)
    found: list[Mismatch] = []
    for mine, other in _pairs(recorded.trace, computed.trace):
        apart = np.abs(mine.values[rows.first].astype(float) - other.values[rows.second])
        beyond = np.flatnonzero(smooth & ~(apart <= SAMPLE_TOLERANCE))
        if len(beyond):
            k = beyond[0]
            places = int(rows.first[k]), int(rows.second[k])
            found.append(_mismatch(mine, other, float(times[k]), *places))
    return sorted(found, key=lambda mismatch: mismatch.time or 0.0)


def _first_switch(pair: RunPair) -> float:
    """Time of the first phase change after the start, in either run."""
    start = pair.recorded.trace.times[0]
    changes = (*pair.recorded.phase_changes, *pair.computed.phase_changes)
    return min((change.time for change in changes if change.time > start), default=np.inf)


def _mismatch(recorded: Column, computed: Column, time: float, mine: int, other: int) -> Mismatch:
    return Mismatch(
        what=recorded.name,
        time=time,
        recorded=recorded.values[mine].item(),
        computed=computed.values[other].item(),
    )


def _change_mismatches(pair: RunPair, tolerance: float) -> Iterator[Mismatch]:
    """The first differing phase change, if any."""
    recorded, computed = pair.recorded.phase_changes, pair.computed_changes
    for mine, other in zip(recorded, computed, strict=False):
        if _kind(mine) != _kind(other) or not _is_close(mine.time, other.time, tolerance):
            yield _change_mismatch(mine, other)
            return
    count = min(len(recorded), len(computed))
    if len(recorded) != len(computed):
        yield _change_mismatch(*((*c[count : count + 1], None)[0] for c in (recorded, computed)))


def _kind(change: PhaseChange) -> tuple[int, int, int]:
    return change.contact, change.from_phase, change.to_phase


def _is_close(time: float, other: float, tolerance: float) -> bool:
    """Whether times agree; without tolerance, to the last bit."""
    return abs(time - other) <= tolerance and (tolerance > 0.0 or repr(time) == repr(other))


def _change_mismatch(recorded: PhaseChange | None, computed: PhaseChange | None) -> Mismatch:
    times = [change.time for change in (recorded, computed) if change is not None]
    said = [None if change is None else _words(change) for change in (recorded, computed)]
    return Mismatch(what="phase_changes", time=min(times), recorded=said[0], computed=said[1])


def _words(change: PhaseChange) -> str:
    phases = f"{change.from_phase.label} to {change.to_phase.label}"
    return f"contact {change.contact} {phases} at {change.time!r} s"


def _unequal(what: str, recorded: Any, computed: Any) -> Iterator[Mismatch]:
    """A mismatch unless both values have the same exact representation."""
    if repr(recorded) != repr(computed):
        yield Mismatch(what=what, time=None, recorded=_shown(recorded), computed=_shown(computed))


def _shown(value: Any) -> str | float | int:
    return value if isinstance(value, (str, float, int)) else repr(value)


def _how_far(pair: RunPair) -> str:
    """Outcome of the new simulation; ``cut short`` if it continues beyond the recorded run."""
    ended = pair.computed.outcome is not Outcome.STOPPED
    has_no_more = len(pair.computed.trace) <= len(pair.recorded.trace)
    return pair.computed.outcome.value if ended and has_no_more else "cut short"


def _expected_metrics(pair: RunPair) -> Metrics | None:
    """The metrics that the recorded run should have; None if its samples do not determine them."""
    recorded, computed = pair.recorded, pair.computed
    count = len(recorded.trace)
    if recorded.outcome is Outcome.RECOVERED:
        changes = computed.phase_changes[: len(recorded.phase_changes)]
        rate = recorded.scenario.simulation.output_rate
        return metrics_of_trace(computed.trace[:count], changes, recorded.outcome, rate)
    return computed.metrics if pair.both_ended or len(computed.trace) == count else None
