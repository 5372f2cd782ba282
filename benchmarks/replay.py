"""Open-loop replay of recorded torques in another engine, and its deviation from our run.

Open loop means that there is no correction: the engine uses the torques that our controller
commanded in our run, regardless of its own motion. A squeezed object is an unstable plant, which
rotates between the tips like a buckling rod. After 0.3 s, an initial rotation of the object has
grown 58 times in case I and 136 times in case II, a displacement twice; after 0.5 s the rotation
has grown thousands of times. So 0.3 s, which contain the slip, its end and some time of stick, show
the engine's error, and much longer replays only its amplification. Control of spatial hands is
sampled, and their torques are held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.space import PLANAR, SPATIAL
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.engines.expected import interpolate, record_densely

Floats = NDArray[np.float64]

CASES = ("paper-case-1", "paper-case-2")
STEPS = (1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5)  # of the other engine [s]
DURATION = 0.3  # [s]

MOVING = 1e-3  # slip speed below which a contact counts as stopped [m/s]


class Replay(NamedTuple):
    """Motion of another engine at the end of each of its steps."""

    times: Floats  # (rows,) [s]
    object_pose: Floats  # (rows, 3) [m, m, rad], in space (rows, 7) [m, 1]
    slip: Floats  # (rows, n), in space (rows, 2 n) [m]

    @classmethod
    def at_steps(cls, step: float, poses: list[Floats], slips: list[Floats]) -> Replay:
        """The motion at the ends of equal steps [s]."""
        times = np.linspace(step, step * len(poses), len(poses))
        return cls(times, np.array(poses), np.array(slips))


class Differences(NamedTuple):
    """Largest differences between an engine's motion and ours, over the whole time."""

    step: float  # the engine's time step, 0 for an extrapolated motion [s]
    position: float  # of the object's centre along an axis [m]
    angle: float  # of the object [rad]
    slip: float  # of any contact [m]
    final_slip: float  # of any contact, at the end [m]
    slip_end: float  # of the time at which any contact stops [s]


def record_case(name: str, duration: float) -> RunResult:
    """Our run of a preset, with continuous control of planar hands, stored densely for the replay.

    Args:
        name: Preset, or path of a scenario.
        duration: Simulated time [s].
    """
    scenario = load_scenario(name)
    if scenario.space is PLANAR:
        scenario = with_values(scenario, {"controller.control_period": 0.0})
    return record_densely(scenario, duration)


def measure_differences(
    replay: Callable[[RunResult, float], Replay],
    name: str,
    steps: Sequence[float] = STEPS,
    duration: float = DURATION,
) -> list[Differences]:
    """The table of differences of a preset: one row per step, and one for the limit.

    Args:
        replay: Replays a run in an engine with a time step [s].
        name: Preset, or path of a scenario.
        steps: Time steps of the engine [s]; the last one is half of the previous one.
        duration: Simulated time [s].
    """
    result = record_case(name, duration)
    replays = [replay(result, step) for step in steps]
    rows = [compare(result, each, step) for each, step in zip(replays, steps, strict=True)]
    return [*rows, compare(result, extrapolate(*replays[-2:]), 0.0)]


def extrapolate(coarse: Replay, fine: Replay) -> Replay:
    """The limit of an engine of first order, from two replays with a step and half of it."""
    return Replay(
        coarse.times,
        2.0 * fine.object_pose[1::2] - coarse.object_pose,
        2.0 * fine.slip[1::2] - coarse.slip,
    )


def slips_of(
    contacts: Sequence[Mapping[str, Any]], place: Floats, turn: Floats, tips: Iterable[Floats]
) -> Floats:
    """Slip of each fingertip from its position in an engine, as in a row of the trace.

    Args:
        contacts: The contacts of the scene.
        place: Position of the object [m].
        turn: Rotation matrix of the object.
        tips: Positions of the fingertips [m].
    """
    return np.concatenate(
        [
            np.array(contact["tangents"]) @ (turn.T @ (tip - place) - contact["anchor"])
            for contact, tip in zip(contacts, tips, strict=True)
        ]
    )


def slip_ends(result: RunResult) -> Floats:
    """Last time at which each contact of a run stops, shape ``(n,)`` [s]."""
    ends = np.full(result.trace.shape.num_contacts, np.nan)
    for change in result.phase_changes:
        if change.to_phase is ContactPhase.STICK:
            ends[change.contact] = change.time
    return ends


def extrapolated_ends(replay: Replay, contacts: int) -> Floats:
    """The same for an engine with fixed steps, from late steps that certainly have slip."""
    step = replay.times[0]
    moves = np.diff(replay.slip, axis=0, prepend=0.0).reshape(len(replay.times), contacts, -1)
    speeds = np.linalg.norm(moves, axis=2) / step
    ends = []
    for speed in speeds.T:
        k = int(np.flatnonzero(speed > MOVING)[-1]) - 2
        ends.append(replay.times[k] + 2.0 * step * speed[k] / (speed[k - 2] - speed[k]))
    return np.array(ends)


def compare(result: RunResult, replay: Replay, step: float) -> Differences:
    """Deviation of a replay from the run whose torques it uses."""
    trace, ends = result.trace, slip_ends(result)
    pose = interpolate(trace, trace.object_pose, replay.times)
    pose_error = np.abs(replay.object_pose - pose)
    ways = trace.shape.space.num_positions
    turn = pose_error[:, ways:]
    if trace.shape.space is SPATIAL:
        turn = 2.0 * np.linalg.norm(turn, axis=1)  # of a small difference of unit quaternions
    slip = interpolate(trace, trace.slip, replay.times)
    slip_error = np.abs(replay.slip - slip)
    return Differences(
        step=step,
        position=float(pose_error[:, :ways].max()),
        angle=float(turn.max()),
        slip=float(slip_error.max()),
        final_slip=float(slip_error[-1].max()),
        slip_end=float(np.abs(extrapolated_ends(replay, len(ends)) - ends).max()),
    )


def print_differences(engine: str, replay: Callable[[RunResult, float], Replay]) -> None:
    """Prints the differences of both cases, in micrometres and microradians.

    Args:
        engine: Name of the engine.
        replay: Replays a run in it with a time step [s].
    """
    heads = ("step [ms]", "position", "angle", "slip", "final slip", "slip end [ms]")
    for name in CASES:
        print(f"{name} in {engine}, {DURATION} s, largest differences [um, urad]")
        print("".join(f"{head:>14}" for head in heads))
        for row in measure_differences(replay, name):
            small = "".join(f"{1e6 * value:14.3f}" for value in row[1:5])
            print(f"{1e3 * row.step:14.4f}{small}{1e3 * row.slip_end:14.3f}")
