"""What a run gives back: trace, phase changes, outcome, reason, warnings and metrics."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import Any

from slipgrasp.core.run.provenance import Provenance
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.trace import OBJECT_COORDINATES, Trace
from slipgrasp.core.trace.types import Outcome, PhaseChange, Reason, RunWarning
from slipgrasp.core.words.display_name import name_run

_PER_CONTACT = ("slip_path", "peak_normal_force", "minimum_friction_margin")
_PER_COORDINATE = ("rms_tracking_error", "final_tracking_error")


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """Figures of merit of a run, SI units; lists have one entry per contact or coordinate.

    Attributes:
        held: Completed with every contact in stick over the last 0.5 s.
        slipping_at_end: Whether any contact slips at the end.
        last_slip_time: When the last slip ended, None if nothing slipped [s].
        slip_path: Way each fingertip slid on its face [m].
        peak_normal_force: Largest normal force of each contact [N].
        minimum_friction_margin: Least margin of each contact in stick, None if never [N].
        rms_tracking_error: Over time, x, y, theta [m, m, rad].
        final_tracking_error: At the end, x, y, theta [m, m, rad].
        torque_effort: Integral of the squared torques [N² m² s].
        phase_change_count: Number of phase changes.
    """

    held: bool
    slipping_at_end: bool
    last_slip_time: float | None
    slip_path: tuple[float, ...]
    peak_normal_force: tuple[float, ...]
    minimum_friction_margin: tuple[float | None, ...]
    rms_tracking_error: tuple[float, float, float]
    final_tracking_error: tuple[float, float, float]
    torque_effort: float
    phase_change_count: int

    def flattened(self) -> dict[str, float | int | bool | None]:
        """One value per name of `metric_names`, for tables: slip_path_0, rms_tracking_error_x."""
        values: list[float | int | bool | None] = []
        for field in fields(self):
            value = getattr(self, field.name)
            values += value if isinstance(value, tuple) else [value]
        return dict(zip(metric_names(len(self.slip_path)), values, strict=True))


@cache
def metric_names(num_contacts: int) -> tuple[str, ...]:
    """Names of the single values of `Metrics`: contacts by index, coordinates by letter.

    Args:
        num_contacts: Fingers of the hand.
    """
    names: list[str] = []
    for field in fields(Metrics):
        if field.name in _PER_CONTACT:
            names += [f"{field.name}_{contact}" for contact in range(num_contacts)]
        elif field.name in _PER_COORDINATE:
            names += [f"{field.name}_{coordinate}" for coordinate in OBJECT_COORDINATES]
        else:
            names.append(field.name)
    return tuple(names)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """A finished run without its trace.

    Attributes:
        scenario: What was simulated.
        outcome: How it ended.
        reason: Why, where it ended early.
        end_time: Simulation time reached [s].
        estimates: Final estimates by dotted key of the unknown.
        metrics: Figures of merit.
        warnings: What is worth knowing but did not end the run.
    """

    scenario: Scenario
    outcome: Outcome
    reason: Reason | None
    end_time: float
    estimates: dict[str, float]
    metrics: Metrics
    warnings: tuple[RunWarning, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunResult:
    """A finished run, live or read back from a recording.

    Attributes:
        scenario: What was simulated.
        trace: What happened, over time.
        phase_changes: Every contact's passages between stick and slip, in time order.
        outcome: How it ended.
        reason: Why, where it ended early.
        warnings: What is worth knowing but did not end the run.
        metrics: Figures of merit.
        provenance: What computed it.
    """

    scenario: Scenario
    trace: Trace
    phase_changes: tuple[PhaseChange, ...]
    outcome: Outcome
    reason: Reason | None
    warnings: tuple[RunWarning, ...]
    metrics: Metrics
    provenance: Provenance

    @property
    def end_time(self) -> float:
        """Simulation time reached [s]."""
        return float(self.trace.times[-1])

    @property
    def estimates(self) -> dict[str, float]:
        """Final estimates by dotted key of the unknown."""
        final = self.trace.estimates[-1]
        return {
            key: float(value) for key, value in zip(self.trace.shape.unknowns, final, strict=True)
        }

    @property
    def name(self) -> str:
        """What tells it from other runs: its preset and what differs from that."""
        return name_run(self.scenario)

    def summary(self) -> dict[str, Any]:
        """The run without its trace, as plain values for JSON (the ``run --json`` object)."""
        return {
            "name": self.name,
            "outcome": self.outcome.value,
            "reason": None if self.reason is None else asdict(self.reason),
            "end_time": self.end_time,
            "phase_changes": [
                {
                    "time": change.time,
                    "contact": change.contact,
                    "from": change.from_phase.label,
                    "to": change.to_phase.label,
                }
                for change in self.phase_changes
            ],
            "estimates": self.estimates,
            "metrics": asdict(self.metrics),
            "warnings": [asdict(warning) for warning in self.warnings],
        }
