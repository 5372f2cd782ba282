"""Figures of merit of a run, from the sums the kernel adds up row by row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.records import Record
from slipgrasp.core.run.result import Metrics
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange

_HOLD_WINDOW = 0.5


def compute_metrics(run: Record, num_contacts: int, outcome: Outcome) -> Metrics:
    """Computes all metrics of a run.

    Args:
        run: Its progress in the kernel.
        num_contacts: Fingers of the hand.
        outcome: How it ended.
    """
    tally, n = run["tally"], num_contacts
    slipping = bool(tally["slipping"])
    settled = bool(tally["last_slip"] <= tally["time"] - _HOLD_WINDOW)
    return Metrics(
        held=outcome is Outcome.COMPLETED and settled and not slipping,
        slipping_at_end=slipping,
        last_slip_time=float(tally["time"]) if slipping else _finite(run["last_stick"]),
        slip_path=tuple(tally["slip_path"][:n].tolist()),
        peak_normal_force=tuple(tally["peak_normal_force"][:n].tolist()),
        minimum_friction_margin=tuple(_finite(m) for m in tally["least_margin"][:n].tolist()),
        rms_tracking_error=_root_mean_square(tally),
        final_tracking_error=_triple(tally["error"]),
        torque_effort=float(tally["effort"]),
        phase_change_count=int(run["all_changes"]),
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _root_mean_square(tally: Record) -> tuple[float, float, float]:
    span = tally["time"] - tally["start"]
    if span == 0.0:
        return _triple(np.abs(tally["error"]))
    return _triple(np.sqrt(tally["squared_error"] / span))


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, theta = values.tolist()
    return x, y, theta


def metrics_of_trace(trace: Trace, changes: Sequence[PhaseChange], outcome: Outcome) -> Metrics:
    """Computes all metrics from a stored trace, for a run whose kernel is gone.

    Args:
        trace: What was stored.
        changes: The phase changes.
        outcome: How the run ended.
    """
    times, sticking = trace.times, trace.phase == ContactPhase.STICK
    end, slipping = float(times[-1]), not sticking[-1].all()
    last_stick = max((c.time for c in changes if c.to_phase is ContactPhase.STICK), default=None)
    settled = bool(sticking[times > end - _HOLD_WINDOW].all())
    return Metrics(
        held=outcome is Outcome.COMPLETED and settled,
        slipping_at_end=slipping,
        last_slip_time=end if slipping else last_stick,
        slip_path=tuple(np.abs(np.diff(trace.slip, axis=0)).sum(axis=0).tolist()),
        peak_normal_force=tuple(trace.normal_force.max(axis=0).tolist()),
        minimum_friction_margin=_least_margins(trace, sticking),
        rms_tracking_error=_rms_over_time(trace),
        final_tracking_error=_triple(trace.tracking_error[-1]),
        torque_effort=float(np.trapezoid((trace.joint_torque**2).sum(axis=1), times)),
        phase_change_count=len(changes),
    )


def _rms_over_time(trace: Trace) -> tuple[float, float, float]:
    span = trace.times[-1] - trace.times[0]
    if span == 0.0:
        return _triple(np.abs(trace.tracking_error[-1]))
    return _triple(np.sqrt(np.trapezoid(trace.tracking_error**2, trace.times, axis=0) / span))


def _least_margins(trace: Trace, sticking: NDArray[np.bool_]) -> tuple[float | None, ...]:
    """Least margin of each contact in stick, without the stick that is assumed at first.

    The first row tells of it where a second one follows at the same time.
    """
    first = int(len(trace) > 1 and trace.times[1] == trace.times[0])
    margins = np.where(sticking, trace.friction_margin, np.inf)[first:]
    return tuple(_finite(m) for m in margins.min(axis=0, initial=np.inf).tolist())
