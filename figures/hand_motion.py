"""Where everything of a hand stands at given times, for pictures that move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.geometry import contact_frame, joint_points, outline
from slipgrasp.core.trace.trace import JOINTS_PER_FINGER

Values = NDArray[np.float64]

_LARGEST = 1e100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandMotion:
    """Points in the plane of the hand over time [m].

    Attributes:
        times: The times, shape ``(times,)`` [s].
        corners: Corners of the object, shape ``(times, corners, 2)``.
        desired: Corners of the object in its desired pose, likewise.
        joints: Base, elbow and tip of each finger, shape ``(times, fingers, 3, 2)``.
        normals: Unit vectors into the object, shape ``(times, contacts, 2)``.
        tangents: Unit vectors of positive slip, shape ``(times, contacts, 2)``.
        forces: Forces on the object, shape ``(times, contacts, 2)`` [N].
        friction: Friction coefficients, shape ``(times, contacts)``.
        slip: Slips, shape ``(times, contacts)`` [m].
        phases: Numbers of the phases, shape ``(times, contacts)``.
    """

    times: Values
    corners: Values
    desired: Values
    joints: Values
    normals: Values
    tangents: Values
    forces: Values
    friction: Values
    slip: Values
    phases: NDArray[np.int8]


def motion_at(result: RunResult, times: Values) -> HandMotion:
    """Reads a run at given times, on straight lines between its samples.

    Args:
        result: The run.
        times: Ascending times within the run, shape ``(times,)`` [s].
    """
    trace, scenario = result.trace, result.scenario
    rows = np.searchsorted(trace.times, times, side="right") - 1

    def read(values: Values) -> Values:
        columns = [np.interp(times, trace.times, column) for column in drawable(values).T]
        return np.stack(columns, axis=1)

    pose = read(trace.object_pose)
    joints = read(trace.joint_position).reshape(len(times), -1, JOINTS_PER_FINGER)
    frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
    tangents = _turned(np.array([frame.tangent for frame in frames]), pose)
    normals = _turned(np.array([frame.normal for frame in frames]), pose)
    normal_force, tangential_force = read(trace.normal_force), read(trace.tangential_force)
    corners = outline(scenario.object)
    desired = pose + read(trace.tracking_error)
    return HandMotion(
        times=times,
        corners=pose[:, None, :2] + _turned(corners, pose),
        desired=desired[:, None, :2] + _turned(corners, desired),
        joints=np.stack(
            [joint_points(f, joints[:, i]) for i, f in enumerate(scenario.fingers)], axis=1
        ),
        normals=normals,
        tangents=tangents,
        # F_x counts along the axis x_c of the contact, against positive slip.
        forces=normal_force[..., None] * normals - tangential_force[..., None] * tangents,
        friction=drawable(trace.friction_coefficient[rows]),
        slip=read(trace.slip),
        phases=trace.phase[rows],
    )


def drawable(values: Values) -> Values:
    """Within what can be drawn: numbers from a file may be as large as numbers get."""
    return values.clip(-_LARGEST, _LARGEST)


def _turned(vectors: Values, pose: Values) -> Values:
    """Vectors of the object frame, shape ``(n, 2)``, at each pose: ``(times, n, 2)``."""
    cos, sin = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = vectors.T
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
