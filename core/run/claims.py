"""Checks of a finished run against its samples: ending, phase changes, slips, metrics.

A run that was just computed always agrees; a file may have been altered, or written by an older
program that ended runs differently.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipgrasp.core.run.metrics import Metrics, least_margins, metrics_of_trace
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.slip_geometry import contact_points, slips_from_poses
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange

ROUNDING = 1e-9
"""Relative difference of two sums over the same rows in a different order."""

LEAST_SLIP = 1e-9
"""Slips that differ by less are equal [m]; computed ones are accurate to 1e-15."""

PATH_ROUNDING = 1e-3
"""Largest excess of the distance between two samples over the integrated path."""

ROWS_AT_ONCE = 1 << 16
"""Number of samples processed at a time, to limit memory for long runs."""


_ENDED_FROM_OUTSIDE = (Outcome.STOPPED, Outcome.LIMIT, Outcome.FAILED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """A statement about a run that contradicts its samples.

    Attributes:
        what: ``outcome``, ``phase_changes``, ``slip`` or ``slip_path`` with the index of a contact,
            or a metric by its name in tables.
        stated: Stated value.
        computed: Value from the samples.
    """

    what: str
    stated: Any
    computed: Any

    def __str__(self) -> str:
        return f"{self.what} is stated as {self.stated}, its samples give {self.computed}"


def contradictions_of(run: RunResult) -> tuple[Contradiction, ...]:
    """All contradictions between the statements and samples of a run; empty for computed runs."""
    scenario = run.scenario
    slips = _of_slips(run, scenario) if isinstance(scenario, SpatialScenario) else ()
    return (*_of_ending(run), *_of_phase_changes(run), *_of_metrics(run), *slips)


def describe_false_end(outcome: Outcome, end_time: float, duration: float) -> str:
    """Describes the early end of a run that claims to be ``completed``.

    Args:
        outcome: Stated outcome.
        end_time: Time of its last row [s].
        duration: Duration in its scenario [s].

    Returns:
        Text such as ``ended at 0.5 s of 7 s``; empty if there is no contradiction.
    """
    reached = math.isfinite(end_time) and abs(end_time - duration) <= ROUNDING * duration
    if outcome is not Outcome.COMPLETED or reached:
        return ""
    return f"ended at {end_time:g} s of {duration:g} s"


def _of_ending(run: RunResult) -> Iterator[Contradiction]:
    duration = run.scenario.simulation.duration
    computed = describe_false_end(run.outcome, run.end_time, duration)
    if not computed and run.outcome is Outcome.COMPLETED and not _last_row_is_finite(run):
        computed = f"not finite at {run.end_time:g} s"
    if computed:
        yield Contradiction(what="outcome", stated=run.outcome.value, computed=computed)


def _last_row_is_finite(run: RunResult) -> bool:
    return bool(np.isfinite(run.trace[-1:].to_rows()).all())


def _of_phase_changes(run: RunResult) -> Iterator[Contradiction]:
    """The first row of each contact whose phase contradicts the preceding phase changes."""
    for contact in range(run.trace.shape.num_contacts):
        changes = [change for change in run.phase_changes if change.contact == contact]
        yield from _of_contact(run, contact, changes)


def _of_contact(
    run: RunResult, contact: int, changes: Sequence[PhaseChange]
) -> Iterator[Contradiction]:
    times, phases = run.trace.times, run.trace.phase[:, contact]
    instants = np.array([change.time for change in changes])
    # Phases before every change and after the last; without changes, the first phase.
    known = [int(change.from_phase) for change in changes]
    known.append(int(changes[-1].to_phase) if changes else int(phases[0]))
    expected = np.array(known)[np.searchsorted(instants, times, side="right")]
    # A change has two rows: before and after it.
    wrong = np.flatnonzero((phases != expected) & ~np.isin(times, instants))
    if len(wrong):
        row = wrong[0]
        where = f" at contact {contact} at {times[row]:g} s"
        yield Contradiction(
            what="phase_changes",
            stated=ContactPhase(int(expected[row])).label + where,
            computed=ContactPhase(int(phases[row])).label + where,
        )


def _of_metrics(run: RunResult) -> Iterator[Contradiction]:
    """Metrics that contradict the samples.

    Metrics of events between samples can only be checked by bounds.
    """
    rate, stated = run.scenario.simulation.output_rate, run.metrics
    computed = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    if not run.has_sample_metrics:
        computed = replace(computed, **dict(_allowed(stated, run.trace)))
        if run.outcome in _ENDED_FROM_OUTSIDE:
            # The run continued for part of an output interval after its last sample.
            paths = zip(stated.slip_path, computed.slip_path, strict=True)
            computed = replace(
                computed, slip_path=tuple(max(path, sample) for path, sample in paths)
            )
    flat = computed.flattened()
    for name, value in stated.flattened().items():
        if not _agree(value, flat[name]):
            yield Contradiction(what=name, stated=value, computed=flat[name])


def _allowed(stated: Metrics, trace: Trace) -> Iterator[tuple[str, Any]]:
    """Bounds of metrics that count events between samples, with the stated values."""
    greatest, least = trace.normal_force.max(axis=0).tolist(), least_margins(trace)
    peaks = zip(stated.peak_normal_force, greatest, strict=True)
    margins = zip(stated.minimum_friction_margin, least, strict=True)
    yield "peak_normal_force", tuple(max(peak, sample) for peak, sample in peaks)
    yield (
        "minimum_friction_margin",
        tuple(
            sample if margin is None or sample is None else min(margin, sample)
            for margin, sample in margins
        ),
    )
    turned = zip(stated.spin_path, np.abs(np.diff(trace.spin, axis=0)).sum(axis=0), strict=True)
    yield "spin_path", tuple(max(path, float(sample)) for path, sample in turned)
    yield "rms_tracking_error", tuple(max(value, 0.0) for value in stated.rms_tracking_error)
    yield "torque_effort", max(stated.torque_effort, 0.0)


def _of_slips(run: RunResult, scenario: SpatialScenario) -> Iterator[Contradiction]:
    """The first row of each contact whose slip or path contradicts the poses of a spatial hand.

    Metrics depend on the path, which is integrated separately.
    """
    for contact in range(run.trace.shape.num_contacts):
        for first in range(0, len(run.trace), ROWS_AT_ONCE):
            # One more row, for the distance from the last row to the next.
            rows = run.trace[first : first + ROWS_AT_ONCE + 1]
            if found := _of_slip(scenario, rows, contact):
                yield found
                break


def _of_slip(scenario: SpatialScenario, rows: Trace, contact: int) -> Contradiction | None:
    with np.errstate(all="ignore"):  # A run that diverged ends with arbitrarily large numbers.
        stated, path = rows.slip[:, 2 * contact : 2 * contact + 2], rows.slip_path[:, contact]
        computed = slips_from_poses(scenario, rows, contact)
        chords = np.linalg.norm(np.diff(contact_points(scenario, rows, contact), axis=0), axis=1)
        false_slip = np.abs(stated - computed).max(axis=1) > LEAST_SLIP * (
            1.0 + np.abs(stated[:, 0])
        )
        short = chords > (1.0 + PATH_ROUNDING) * np.diff(path) + LEAST_SLIP
    if len(wrong := np.flatnonzero(false_slip)):
        row = wrong[0]
        where = f"({{:g}}, {{:g}}) m at {rows.times[row]:g} s"
        return Contradiction(
            what=f"slip_{contact}",
            stated=where.format(*stated[row]),
            computed=where.format(*computed[row]),
        )
    if len(wrong := np.flatnonzero(short)):
        row = wrong[0]
        where = f"{{:g}} m from {rows.times[row]:g} to {rows.times[row + 1]:g} s"
        return Contradiction(
            what=f"slip_path_{contact}",
            stated=where.format(path[row + 1] - path[row]),
            computed=f"at least {where.format(chords[row])}",
        )
    return None


def _agree(stated: float | None, computed: float | None) -> bool:
    """True if two values are equal except for rounding; flags and counts must be equal."""
    if stated is None or computed is None:
        return stated is computed
    return stated == computed or math.isclose(stated, computed, rel_tol=ROUNDING)
