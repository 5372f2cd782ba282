"""One instant of a run, read off its trace: what the scene and the read-outs show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.trace import JOINTS_PER_FINGER, Trace
from core.types import ContactPhase

__all__ = ["Sample", "sample_at"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """The state of hand, object and contacts at one time, SI units.

    Attributes:
        time: Simulation time [s].
        object_pose: Pose x, y, theta [m, m, rad].
        desired_pose: Desired pose x, y, theta [m, m, rad].
        slip: Displacement of each fingertip along its face [m].
        slip_reach: Least and largest slip of each fingertip so far, shape ``(contacts, 2)`` [m].
        slip_velocity: Its first derivative [m/s].
        phases: Phase of each contact.
        tangential_force: F_x of each fingertip on the object [N].
        normal_force: F_n of each fingertip on the object [N].
        friction: True friction coefficient of each contact.
        joint_positions: Joint angles, shape ``(fingers, joints)`` [rad].
        estimates: Estimates of the unknown parameters.
    """

    time: float
    object_pose: NDArray[np.float64]
    desired_pose: NDArray[np.float64]
    slip: NDArray[np.float64]
    slip_reach: NDArray[np.float64]
    slip_velocity: NDArray[np.float64]
    phases: tuple[ContactPhase, ...]
    tangential_force: NDArray[np.float64]
    normal_force: NDArray[np.float64]
    friction: NDArray[np.float64]
    joint_positions: NDArray[np.float64]
    estimates: NDArray[np.float64]


def sample_at(trace: Trace, time: float) -> Sample:
    """The state at a time, on the straight line between two rows of the trace.

    Two rows at one time are the two sides of an event; at that very time the side after
    it is taken, so no line ever crosses an event.

    Args:
        trace: The run.
        time: Simulation time [s]; moved into the run if outside.
    """
    last = len(trace) - 1
    row = min(max(int(np.searchsorted(trace.times, time, side="right")) - 1, 0), last)
    following = min(row + 1, last)
    span = trace.times[following] - trace.times[row]
    weight = min(max((time - trace.times[row]) / span, 0.0), 1.0) if span > 0.0 else 0.0

    def between(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values[row] + weight * (values[following] - values[row])

    pose, slip = between(trace.object_pose), between(trace.slip)
    visited = np.concatenate([trace.slip[: row + 1], slip[None]])
    return Sample(
        time=float(between(trace.times)),
        object_pose=pose,
        desired_pose=pose + between(trace.tracking_error),
        slip=slip,
        slip_reach=np.stack([visited.min(axis=0), visited.max(axis=0)], axis=1),
        slip_velocity=between(trace.slip_velocity),
        phases=tuple(ContactPhase(int(phase)) for phase in trace.phase[row]),
        tangential_force=between(trace.tangential_force),
        normal_force=between(trace.normal_force),
        friction=trace.friction_coefficient[row],
        joint_positions=between(trace.joint_position).reshape(-1, JOINTS_PER_FINGER),
        estimates=between(trace.estimates),
    )
