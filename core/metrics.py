"""Figures of merit of a run, from its trace and phase changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from core.result import Metrics
from core.trace import Trace
from core.types import ContactPhase, Outcome, PhaseChange

__all__ = ["compute_metrics"]

_HOLD_WINDOW = 0.5


def compute_metrics(trace: Trace, changes: Sequence[PhaseChange], outcome: Outcome) -> Metrics:
    """Computes all metrics of a run that has at least one row.

    Args:
        trace: What happened.
        changes: All phase changes in order of time.
        outcome: How it ended.
    """
    slipping = trace.phase != ContactPhase.STICK
    late = trace.times > trace.times[-1] - _HOLD_WINDOW
    settled = not bool(slipping[late].any())
    slipping_at_end = bool(slipping[-1].any())
    return Metrics(
        held=outcome is Outcome.COMPLETED and settled and not slipping_at_end,
        slipping_at_end=slipping_at_end,
        last_slip_time=_last_slip_time(trace, changes, slipping_at_end),
        slip_path=tuple(np.abs(np.diff(trace.slip, axis=0)).sum(axis=0).tolist()),
        peak_normal_force=tuple(trace.normal_force.max(axis=0).tolist()),
        minimum_friction_margin=_least_margins(trace, slipping),
        rms_tracking_error=_root_mean_square(trace.times, trace.tracking_error),
        final_tracking_error=_triple(trace.tracking_error[-1]),
        torque_effort=float(np.trapezoid((trace.joint_torque**2).sum(axis=1), trace.times)),
        phase_change_count=len(changes),
    )


def _last_slip_time(
    trace: Trace, changes: Sequence[PhaseChange], slipping_at_end: bool
) -> float | None:
    if slipping_at_end:
        return float(trace.times[-1])
    ends = [change.time for change in changes if change.to_phase is ContactPhase.STICK]
    return max(ends, default=None)


def _least_margins(trace: Trace, slipping: NDArray[np.bool_]) -> tuple[float | None, ...]:
    """Over sticking rows; not the row that only assumes stick before the first selection."""
    assumed = np.zeros(len(trace), dtype=bool)
    assumed[0] = len(trace) > 1 and trace.times[1] == trace.times[0]
    least: list[float | None] = []
    for contact in range(trace.shape.num_contacts):
        margins = trace.friction_margin[~slipping[:, contact] & ~assumed, contact]
        least.append(float(margins.min()) if len(margins) else None)
    return tuple(least)


def _root_mean_square(
    times: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[float, float, float]:
    span = times[-1] - times[0]
    if span == 0.0:
        return _triple(np.abs(values[-1]))
    return _triple(np.sqrt(np.trapezoid(values**2, times, axis=0) / span))


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, theta = values.tolist()
    return x, y, theta
