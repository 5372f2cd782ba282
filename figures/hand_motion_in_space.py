"""A hand in space over time as the eye sees it, for pictures that move.

Everything is laid flat by a parallel projection, so that whoever draws hands in the plane draws it:
the object is the outline of its prism with the edges in it, a friction cone the outline of its
disc and its tip. The eye stands where fingertips hide each other least, and fingers the object.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import (
    base_corners,
    friction_outline,
    rotation_matrix,
    spatial_contact,
    spatial_joint_points,
)
from slipgrasp.core.trace.trace import JOINTS_IN_SPACE
from slipgrasp.figures.hand_motion import HandMotion, Reader

Values = NDArray[np.float64]

_ELEVATION = math.radians(24.0)
_ASIDE = math.radians(8.0)
_IN_FRONT = 0.5  # what a finger in front of the object costs
_AZIMUTHS = np.radians(np.arange(-180.0, 180.0, 5.0))


def spatial_motion_at(result: RunResult, times: Values) -> HandMotion:
    """Reads a run of a hand in space at given times, as seen by the eye.

    Args:
        result: The run.
        times: Ascending times within the run, shape ``(times,)`` [s].
    """
    trace, scenario = result.trace, result.scenario
    assert isinstance(scenario, SpatialScenario), "a hand in the plane needs no eye"
    read = Reader(trace.times, times)
    pose, error = read.between(trace.object_pose), read.between(trace.tracking_error)
    turns = np.array([_rotation(quaternion) for quaternion in pose[:, 3:]])
    frames = [spatial_contact(scenario.object, finger) for finger in scenario.fingers]
    # Columns t_x, t_y, n of every contact in world axes: (times, contacts, 3, 3).
    local = np.array([[f.tangent_x, f.tangent_y, f.normal] for f in frames])
    axes = np.einsum("tij,ckj->tcki", turns, local)
    attitude = _rotation(trace.object_pose[0, 3:])
    anchors = np.array([frame.anchor for frame in frames])
    flat = _eye(anchors @ attitude.T, local[:, 2] @ attitude.T)
    angles = read.between(trace.joint_position).reshape(len(times), -1, JOINTS_IN_SPACE)
    joints = [spatial_joint_points(f, angles[:, i]) for i, f in enumerate(scenario.fingers)]
    tangential = read.between(trace.tangential_force).reshape(len(times), -1, 2)
    parts = np.concatenate([-tangential, read.between(trace.normal_force)[..., None]], axis=2)
    friction = read.last(trace.friction_coefficient)
    points = _prisms(scenario, pose[:, :3], turns)
    desired = _prisms(scenario, *_wanted(pose, error))
    rim = friction_outline(scenario, corners=24)
    discs = axes[:, :, 2:3] + friction[..., None, None] * np.einsum(
        "rk,tcki->tcri", rim, axes[:, :, :2]
    )
    normals = axes[:, :, 2] @ flat
    return HandMotion(
        times=times,
        corners=_outlines(points @ flat),
        desired=_outlines(desired @ flat),
        edges=_edges(points @ flat),
        joints=np.stack(joints, axis=1) @ flat,
        normals=normals,
        cones=_outlines(np.concatenate([np.zeros_like(normals)[:, :, None], discs @ flat], axis=2)),
        forces=np.einsum("tck,tcki->tci", parts, axes) @ flat,
        behind=axes[0, :, 2] @ np.cross(flat[:, 0], flat[:, 1]) > 0.0,
        slip=read.between(trace.slip_path),
        phases=read.last(trace.phase),
    )


def _eye(anchors: Values, normals: Values) -> Values:
    """Right and up of the picture as columns, ``(3, 2)``.

    Args:
        anchors: Contacts about the middle of the object, ``(contacts, 3)`` [m].
        normals: Their normals into the object, likewise.
    """
    size = float(np.abs(anchors).max())

    def merit(azimuth: float) -> float:
        c, s = math.cos(azimuth), math.sin(azimuth)
        apart = float(np.diff(np.sort(anchors[:, :2] @ [c, s])).min()) / size
        in_front = float((normals[:, :2] @ [-s, c]).max())
        return round(apart - _IN_FRONT * in_front, 6)

    azimuth = float(max(_AZIMUTHS, key=merit)) + _ASIDE
    c, s = math.cos(azimuth), math.sin(azimuth)
    up = (-s * math.sin(_ELEVATION), c * math.sin(_ELEVATION), math.cos(_ELEVATION))
    return np.array([(c, s, 0.0), up]).T


def _wanted(pose: Values, error: Values) -> tuple[Values, Values]:
    """Desired positions and attitudes; errors are rotation vectors in world axes."""
    turns = [
        _rotation(_quaternion(turn)) @ _rotation(quaternion)
        for turn, quaternion in zip(error[:, 3:], pose[:, 3:], strict=True)
    ]
    return pose[:, :3] + error[:, :3], np.array(turns)


def _quaternion(turn: Values) -> Values:
    """Of a rotation vector."""
    angle = math.hypot(*turn)
    scale = 0.5 if angle == 0.0 else math.sin(0.5 * angle) / angle
    return np.array([math.cos(0.5 * angle), *(scale * turn)])


def _rotation(quaternion: Values) -> Values:
    w, x, y, z = quaternion.tolist()
    return np.array(rotation_matrix((w, x, y, z)))


def _prisms(scenario: SpatialScenario, positions: Values, turns: Values) -> Values:
    """Corners of the object, ``(times, 2 corners, 3)``: those below, then those above."""
    base, half = np.array(base_corners(scenario.object)), 0.5 * scenario.object.height
    corners = np.concatenate(
        [np.column_stack([base, np.full(len(base), z)]) for z in (-half, half)]
    )
    return positions[:, None] + np.einsum("tij,cj->tci", turns, corners)


def _edges(points: Values) -> Values:
    """Edges between the corners of prisms ``(times, 2 corners, 2)``: ``(times, edges, 2, 2)``."""
    count = points.shape[1] // 2
    low, high = points[:, :count], points[:, count:]
    pairs = [(low, np.roll(low, -1, axis=1)), (high, np.roll(high, -1, axis=1)), (low, high)]
    return np.concatenate([np.stack(pair, axis=2) for pair in pairs], axis=1)


def _outlines(points: Values) -> Values:
    """Convex outlines of sets of points ``(..., points, 2)``, the last corner repeated."""
    flat = points.reshape(-1, *points.shape[-2:])
    return np.stack([_outline(each) for each in flat]).reshape(points.shape)


def _outline(points: Values) -> Values:
    """The convex hull, counterclockwise (Andrew's monotone chain), as many points as there were."""
    ordered = sorted(map(tuple, points.tolist()))
    hull: list[tuple[float, ...]] = []
    for run in (ordered, ordered[::-1]):
        start = len(hull)
        for point in run:
            while len(hull) - start >= 2 and _turn(hull[-2], hull[-1], point) <= 0.0:
                hull.pop()
            hull.append(point)
        hull.pop()
    hull = hull or ordered[:1]
    return np.array(hull + hull[-1:] * (len(points) - len(hull)))


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
