"""Whether what a finished run claims is what its samples say: ending, phase changes, metrics.

A run that was just computed claims nothing else; a file may have been altered, or be of an older
program that ended runs otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange

ROUNDING = 1e-9
"""Relative difference of two sums over the same rows that were added up in another order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contradiction:
    """Something that is stated of a run and that its samples do not bear out.

    Attributes:
        what: ``outcome``, ``phase_changes``, or a metric by its name in tables.
        stated: What is said.
        computed: What the samples give.
    """

    what: str
    stated: Any
    computed: Any

    def __str__(self) -> str:
        return f"{self.what} is stated as {self.stated}, its samples give {self.computed}"


def contradictions_of(run: RunResult) -> tuple[Contradiction, ...]:
    """All that a run claims against its own samples; empty for every run that was computed."""
    return (*_of_ending(run), *_of_phase_changes(run), *_of_metrics(run))


def describe_false_end(outcome: Outcome, end_time: float, duration: float) -> str:
    """How a run that says ``completed`` ended without having been simulated to its end.

    Args:
        outcome: What it says.
        end_time: Time of its last row [s].
        duration: How long it was to be [s].

    Returns:
        Words such as ``ended at 0.5 s of 7 s``; empty if there is nothing false.
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
    """The first row of each contact whose phase is not that of the changes before it."""
    for contact in range(run.trace.shape.num_contacts):
        changes = [change for change in run.phase_changes if change.contact == contact]
        yield from _of_contact(run, contact, changes)


def _of_contact(
    run: RunResult, contact: int, changes: Sequence[PhaseChange]
) -> Iterator[Contradiction]:
    times, phases = run.trace.times, run.trace.phase[:, contact]
    instants = np.array([change.time for change in changes])
    # The phase before every change, and after the last; a run without any keeps its first.
    known = [int(change.from_phase) for change in changes]
    known.append(int(changes[-1].to_phase) if changes else int(phases[0]))
    expected = np.array(known)[np.searchsorted(instants, times, side="right")]
    # At the instant of a change one row tells of before and one of after.
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
    rate = run.scenario.simulation.output_rate
    computed = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate).flattened()
    for name, stated in run.metrics.flattened().items():
        if not _agree(stated, computed[name]):
            yield Contradiction(what=name, stated=stated, computed=computed[name])


def _agree(stated: float | None, computed: float | None) -> bool:
    """Whether two figures are the same but for rounding; flags and counts have none."""
    if stated is None or computed is None:
        return stated is computed
    return stated == computed or math.isclose(stated, computed, rel_tol=ROUNDING)
