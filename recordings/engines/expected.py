"""The torques for a scene in another engine, and the expected motion.

Torques are applied open loop, without correction. A squeezed object is an unstable plant, which
rotates between the tips like a buckling rod, so only the first tenths of a second compare the
engines rather than this instability.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.core.trace.trace import Trace

Floats = NDArray[np.float64]

DURATION = 0.2  # [s]
OUTPUT_RATE = 1e4  # [Hz]; between rows, torques deviate from a line by less than 1e-5 of their size
_ROWS = 30  # stated instants
_INSTANT = 1e-9  # beyond the rounding of times [s]
# For the presets in tests/outside, MuJoCo needs at most two thirds of these, Drake three quarters.
_SHARE_OF_SLIP, _LEAST = 2e-3, 1e-5  # [1, m]


def record_densely(scenario: Scenario, duration: float) -> RunResult:
    """A run whose torques can be replayed.

    Args:
        scenario: The hand and its object.
        duration: Simulated time [s].
    """
    values = {"simulation.output_rate": OUTPUT_RATE, "simulation.duration": duration}
    return simulate(with_values(scenario, values))


def mean_torques(result: RunResult, step: float) -> Floats:
    """Mean joint torque over each step of an engine, shape ``(steps, joints)`` [N m].

    The mean has the impulse of the recorded torque. Two rows at one time (an event, at
    which the torque jumps) have no duration and need no special case.
    """
    trace, ticks = result.trace, result.ticks
    if ticks:
        # A held torque acts after the latency and within the limits, as in the rows.
        acting = ticks.times + of_hand(result.scenario).controller.latency
        times = np.array(
            [0.0, *acting[(acting > 0.0) & (acting < trace.times[-1])], trace.times[-1]]
        )
        torques = trace.joint_torque[np.searchsorted(trace.times, times[1:] - _INSTANT) - 1]
    else:
        times, torques = trace.times, 0.5 * (trace.joint_torque[1:] + trace.joint_torque[:-1])
    areas = np.diff(times)[:, None] * torques
    impulses = np.concatenate((np.zeros((1, torques.shape[1])), np.cumsum(areas, axis=0)))
    edges = step * np.arange(round(times[-1] / step) + 1)
    at_edges = np.stack([np.interp(edges, times, column) for column in impulses.T], axis=1)
    return (at_edges[1:] - at_edges[:-1]) / step


def interpolate(trace: Trace, signal: Floats, times: Floats) -> Floats:
    """A signal at given times, shape ``(times, columns)``."""
    return np.stack([np.interp(times, trace.times, column) for column in signal.T], axis=1)


def expected_answer(result: RunResult, step: float) -> dict[str, Any]:
    """Torques per step, and slips, forces and phases at stated times, as plain values, SI units.

    Args:
        result: A run that starts from rest, densely stored.
        step: Time step of the engine [s].
    """
    trace, torques = result.trace, mean_torques(result, step)
    steps = np.linspace(0, len(torques), _ROWS + 1).round().astype(int)[1:]
    times = step * steps
    signals = ("slip", "normal_force", "tangential_force")
    largest = float(np.abs(trace.slip).max())
    return {
        "scenario": result.name,
        "step": step,
        "torques": torques.tolist(),
        "times": times.tolist(),
        **{name: interpolate(trace, getattr(trace, name), times).tolist() for name in signals},
        "phase_changes": [
            {"time": each.time, "contact": each.contact, "to": each.to_phase.name.lower()}
            for each in result.phase_changes
        ],
        "creep": 0.0,
        "tolerance": {"slip": _SHARE_OF_SLIP * largest + _LEAST},
    }
