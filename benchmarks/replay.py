"""Recorded torques played open loop into another engine, and how far it strays from our run.

Open loop means that nothing corrects the engine: it gets the torques that our controller
commanded in our run, whatever its own hand does. A squeezed object is an unstable plant, which
turns away between the tips like a rod that buckles. After 0.3 s, a turn of the object at the
start has grown 58 times in case I and 136 times in case II, a shift twice; after 0.5 s the
turn has grown thousands of times. So 0.3 s, which hold the slip, its end and a while of
stick, show the engine's own error, and much longer replays only its amplification.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.trace import Trace

Floats = NDArray[np.float64]

CASES = ("paper-case-1", "paper-case-2")
STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5)  # of the other engine [s]
DURATION = 0.3  # [s]

OUTPUT_RATE = 1e4  # [Hz]; between its rows torques bend by less than 1e-5 of their size
MOVING = 1e-3  # slip speed below which a contact counts as stopped [m/s]


class Replay(NamedTuple):
    """Motion of another engine at the end of each of its steps."""

    times: Floats  # (rows,) [s]
    object_pose: Floats  # (rows, 3) [m, m, rad]
    slip: Floats  # (rows, n) [m]


class Differences(NamedTuple):
    """Largest differences between an engine's motion and ours, over the whole time."""

    step: float  # the engine's time step, 0 for an extrapolated motion [s]
    position: float  # of the object's centre, x or y [m]
    angle: float  # of the object [rad]
    slip: float  # of any contact [m]
    final_slip: float  # of any contact, at the end [m]
    slip_end: float  # between the times at which the last contact stops [s]


def record_case(name: str, duration: float) -> RunResult:
    """Our run of a preset with continuous control, stored densely enough to be played back.

    Args:
        name: Preset, or path of a scenario.
        duration: Simulated time [s].
    """
    values = {
        "controller.control_period": 0.0,
        "simulation.output_rate": OUTPUT_RATE,
        "simulation.duration": duration,
    }
    return simulate(with_values(load_scenario(name), values))


def mean_torques(trace: Trace, step: float) -> Floats:
    """Mean joint torque over each step of an engine, shape ``(steps, joints)`` [N m].

    The mean has the impulse of the recorded torque. Two rows at one time (an event, at
    which the torque jumps) enclose no time and so need no case of their own.
    """
    torques = trace.joint_torque
    areas = 0.5 * np.diff(trace.times)[:, None] * (torques[1:] + torques[:-1])
    impulses = np.concatenate((np.zeros((1, torques.shape[1])), np.cumsum(areas, axis=0)))
    edges = step * np.arange(round(trace.times[-1] / step) + 1)
    at_edges = np.stack([np.interp(edges, trace.times, column) for column in impulses.T], axis=1)
    return (at_edges[1:] - at_edges[:-1]) / step


def slip_of(scenario: Scenario, object_pose: Floats, tips: Floats) -> Floats:
    """Slip of each fingertip from its position relative to the object, ``(n,)`` [m].

    Args:
        scenario: The hand.
        object_pose: ``(3,)`` [m, m, rad].
        tips: ``(n, 2)`` fingertips in the inertial frame [m].
    """
    c, s = np.cos(object_pose[2]), np.sin(object_pose[2])
    local = (tips - object_pose[:2]) @ np.array([[c, -s], [s, c]])
    frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
    return np.array(
        [
            (tip - frame.anchor) @ np.array(frame.tangent)
            for tip, frame in zip(local, frames, strict=True)
        ]
    )


def extrapolate(coarse: Replay, fine: Replay) -> Replay:
    """The limit of an engine of first order, from two replays with a step and half of it."""
    return Replay(
        coarse.times,
        2.0 * fine.object_pose[1::2] - coarse.object_pose,
        2.0 * fine.slip[1::2] - coarse.slip,
    )


def compare(trace: Trace, replay: Replay, step: float) -> Differences:
    """How far a replay strays from the run whose torques it was given."""
    pose = _interpolate(trace, trace.object_pose, replay.times)
    pose_error = np.abs(replay.object_pose - pose)
    slip = _interpolate(trace, trace.slip, replay.times)
    slip_error = np.abs(replay.slip - slip)
    return Differences(
        step=step,
        position=float(pose_error[:, :2].max()),
        angle=float(pose_error[:, 2].max()),
        slip=float(slip_error.max()),
        final_slip=float(slip_error[-1].max()),
        slip_end=abs(_slip_end(replay.times, replay.slip) - _slip_end(replay.times, slip)),
    )


def format_table(title: str, rows: Iterable[Differences]) -> str:
    """The differences as lines of text, micrometres and microradians."""
    heads = ("step [ms]", "position", "angle", "slip", "final slip", "slip end [ms]")
    lines = [f"{title}, largest differences [um, urad]", "".join(f"{head:>14}" for head in heads)]
    for row in rows:
        small = "".join(f"{1e6 * value:14.3f}" for value in row[1:5])
        lines.append(f"{1e3 * row.step:14.4f}{small}{1e3 * row.slip_end:14.3f}")
    return "\n".join(lines)


def _interpolate(trace: Trace, signal: Floats, times: Floats) -> Floats:
    return np.stack([np.interp(times, trace.times, column) for column in signal.T], axis=1)


def _slip_end(times: Floats, slip: Floats) -> float:
    """End of the last step in which a contact moves; both motions are measured like this."""
    speeds = np.abs(np.diff(slip, axis=0)).max(axis=1) / np.diff(times)
    return float(times[1 + np.flatnonzero(speeds > MOVING)[-1]])
