"""Figures of merit of a run, from the sums the kernel adds up row by row."""

from __future__ import annotations

import math

import numpy as np

from core.kernel.records import Record
from core.result import Metrics
from core.types import Outcome

__all__ = ["compute_metrics"]

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
