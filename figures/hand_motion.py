"""Where everything of a hand stands at given times, for pictures that move.

A hand in space is laid flat for them (`slipgrasp.figures.hand_motion_in_space`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.geometry import contact_frame, joint_points, outline
from slipgrasp.core.trace.trace import JOINTS_PER_FINGER

Values = NDArray[np.float64]

_LARGEST = 1e100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandMotion:
    """Points in the plane of the hand, or of the picture, over time [m].

    Attributes:
        times: The times, shape ``(times,)`` [s].
        corners: Corners of the object, shape ``(times, corners, 2)``.
        desired: Corners of the object in its desired pose, likewise.
        edges: Other edges of the object, shape ``(times, edges, 2, 2)``; none in the plane.
        joints: Base, elbow and tip of each finger, shape ``(times, fingers, 3, 2)``.
        normals: Unit vectors into the object, shape ``(times, contacts, 2)``.
        cones: Outlines of friction cones of height 1, from their tips, ``(times, contacts, k, 2)``.
        forces: Forces on the object, shape ``(times, contacts, 2)`` [N].
        behind: Which fingers touch the object from behind, shape ``(contacts,)``.
        slip: Slips, in space ways slid, shape ``(times, contacts)`` [m].
        phases: Numbers of the phases, shape ``(times, contacts)``.
    """

    times: Values
    corners: Values
    desired: Values
    edges: Values
    joints: Values
    normals: Values
    cones: Values
    forces: Values
    behind: NDArray[np.bool_]
    slip: Values
    phases: NDArray[np.int8]


class Reader:
    """Reads signals of a trace at given times.

    Args:
        rows: Times of the rows, shape ``(rows,)`` [s].
        times: Ascending times within them, shape ``(times,)`` [s].
    """

    def __init__(self, rows: Values, times: Values) -> None:
        self._rows, self._times = rows, times
        self._last = np.searchsorted(rows, times, side="right") - 1

    def between(self, values: Values) -> Values:
        """On the straight lines between rows, ``(times, columns)``."""
        columns = [np.interp(self._times, self._rows, column) for column in drawable(values).T]
        return np.stack(columns, axis=1)

    def last(self, values: NDArray[Any]) -> NDArray[Any]:
        """As in the last row before, ``(times, columns)``."""
        return drawable(values[self._last])


def motion_at(result: RunResult, times: Values) -> HandMotion:
    """Reads a run at given times, on straight lines between its samples.

    Args:
        result: The run.
        times: Ascending times within the run, shape ``(times,)`` [s].
    """
    trace, scenario = result.trace, result.scenario
    reader = Reader(trace.times, times)
    read = reader.between
    pose = read(trace.object_pose)
    joints = read(trace.joint_position).reshape(len(times), -1, JOINTS_PER_FINGER)
    frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
    tangents = _turned(np.array([frame.tangent for frame in frames]), pose)
    normals = _turned(np.array([frame.normal for frame in frames]), pose)
    normal_force, tangential_force = read(trace.normal_force), read(trace.tangential_force)
    corners = outline(scenario.object)
    desired = pose + read(trace.tracking_error)
    aside = reader.last(trace.friction_coefficient)[..., None] * tangents
    return HandMotion(
        times=times,
        corners=pose[:, None, :2] + _turned(corners, pose),
        desired=desired[:, None, :2] + _turned(corners, desired),
        edges=np.zeros((len(times), 0, 2, 2)),
        joints=np.stack(
            [joint_points(f, joints[:, i]) for i, f in enumerate(scenario.fingers)], axis=1
        ),
        normals=normals,
        cones=np.stack([np.zeros_like(normals), normals + aside, normals - aside], axis=2),
        # F_x counts along the axis x_c of the contact, against positive slip.
        forces=normal_force[..., None] * normals - tangential_force[..., None] * tangents,
        behind=np.zeros(len(frames), dtype=np.bool_),
        slip=read(trace.slip),
        phases=reader.last(trace.phase),
    )


def drawable(values: NDArray[Any]) -> NDArray[Any]:
    """Within what can be drawn: numbers from a file may be as large as numbers get."""
    return values.clip(-_LARGEST, _LARGEST)


def _turned(vectors: Values, pose: Values) -> Values:
    """Vectors of the object frame, shape ``(n, 2)``, at each pose: ``(times, n, 2)``."""
    cos, sin = np.cos(pose[:, 2, None]), np.sin(pose[:, 2, None])
    x, y = vectors.T
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
