"""How a body on a support or a rail moved, as text."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.rail import RailScenario
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.phrases import joined, length_words

_LEAST_TURN = 1e-6  # [rad]
_FINGER, _RAIL = range(2)


def headline_of_slide(scenario: Scenario, metrics: Metrics) -> str:
    """How far a body slid and turned in a complete run, and when it stopped."""
    if isinstance(scenario, RailScenario):
        return _headline_on_rail(metrics)
    slid, turned = metrics.slip_path[0], metrics.spin_path[0]
    moves = [f"slid {length_words(slid)}"] * (slid > 0.0)
    moves += [f"turned {math.degrees(turned):.3g}°"] * (turned > _LEAST_TURN)
    if not moves:
        return "The body stayed at rest"
    return f"The body {joined([*moves, *_stop(metrics)])}"


def _headline_on_rail(metrics: Metrics) -> str:
    """How far an object slid along a rail, and the fingertip along the object."""
    moved, slipped = metrics.slip_path[_RAIL], metrics.slip_path[_FINGER]
    if moved == slipped == 0.0:
        return "The object stayed at rest"
    along = f"Moved {length_words(moved)}" if moved > 0.0 else "The object did not move"
    finger = f"the fingertip slid {length_words(slipped)}" if slipped > 0.0 else ""
    finger = finger or "the fingertip did not slip"
    slides = ["still in motion at the end"] * metrics.slipping_at_end
    return "; ".join([along, finger, *slides])


def describe_motion(metrics: Metrics, trace: Trace) -> Iterator[str]:
    """Facts about a run on a rail in sentences: errors, forces, estimate and energy."""
    error, largest = metrics.final_tracking_error[0], metrics.peak_normal_force[_FINGER]
    yield (
        f"The error at the end is {length_words(abs(error))}, "
        f"{length_words(metrics.rms_tracking_error[0])} rms; the largest normal force of the "
        f"fingertip was {largest:.3g} N."
    )
    if trace.estimates.size:
        first, last = float(trace.estimates[0, 0]), float(trace.estimates[-1, 0])
        true = float(trace.true_parameters[-1, 0])
        yield (
            f"The estimated mass went from {first:.3g} to {last:.3g} kg; "
            f"the true one is {true:.3g} kg."
        )
    margin = metrics.minimum_friction_margin[_FINGER]
    if margin is not None and metrics.slip_path[_FINGER] == 0.0:
        yield f"The fingertip could bear at least {margin:.3g} N more along its face."
    yield f"Friction dissipated {float(trace.dissipated_energy[-1]):.3g} J."


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
        turns = f" and {abs(omega):.3g} rad/s" if omega else ""
        yield f"The final speed is {math.hypot(vx, vy):.3g} m/s{turns}."
    elif margin is not None:
        yield f"At rest, friction could bear at least {margin:.3g} N more."


def slows_down(trace: Trace) -> bool:
    """Whether the kinetic energy decreases at the end, so that a longer run may end at rest."""
    energy = trace.kinetic_energy[-2:]
    return len(energy) == 2 and bool(energy[1] < energy[0])
