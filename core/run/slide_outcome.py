"""How a body on a support moved, as text."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.phrases import joined, length_words

_LEAST_TURN = 1e-6  # [rad]


def headline_of_slide(metrics: Metrics) -> str:
    """How far a body slid and turned in a complete run, and when it stopped."""
    slid, turned = metrics.slip_path[0], metrics.spin_path[0]
    moves = [f"slid {length_words(slid)}"] * (slid > 0.0)
    moves += [f"turned {math.degrees(turned):.3g}°"] * (turned > _LEAST_TURN)
    if not moves:
        return "The body stayed at rest"
    return f"The body {joined([*moves, *_stop(metrics)])}"


def _stop(metrics: Metrics) -> Iterator[str]:
    if metrics.slipping_at_end:
        yield "still slides at the end"
    elif metrics.last_slip_time is not None:
        yield f"stopped at {metrics.last_slip_time:.3g} s"


def describe_slide(trace: Trace, metrics: Metrics) -> Iterator[str]:
    """Facts about a run in sentences: energy, and the margin at rest or the speed at the end."""
    lost, margin = float(trace.dissipated_energy[-1]), metrics.minimum_friction_margin[0]
    if lost > 0.0:
        yield f"Friction dissipated {lost:.3g} J."
    if metrics.slipping_at_end:
        vx, vy, omega = trace.object_velocity[-1].tolist()
        turns = f" and turns at {abs(omega):.3g} rad/s" if omega else ""
        yield f"At the end it moves at {math.hypot(vx, vy):.3g} m/s{turns}."
    elif margin is not None:
        yield f"At rest, friction could bear at least {margin:.3g} N more."


def slows_down(trace: Trace) -> bool:
    """Whether the kinetic energy decreases at the end, so that a longer run may end at rest."""
    energy = trace.kinetic_energy[-2:]
    return len(energy) == 2 and bool(energy[1] < energy[0])
