"""Slips of the fingertips of a spatial hand from joint positions and object pose.

The slips in a recording follow from the pose of the object and the joint positions (docs/space.md):
for tip p, object position x and attitude R, and a contact with anchor a and tangents t_x and t_y,
the slips are t_x, t_y of R^T (p - x) - a; on a curved face they are those of the nearest point of
its surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.curved_faces import slide, slips_of
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import spatial_contact, spatial_joint_points
from slipgrasp.core.trace.trace import Trace

Floats = NDArray[np.float64]

_JOINTS = SPATIAL.joints_per_finger


def slips_from_poses(scenario: SpatialScenario, trace: Trace, index: int) -> Floats:
    """Slips of one contact along its tangents.

    Args:
        scenario: Scenario of a spatial hand.
        trace: Samples of its run.
        index: The contact.

    Returns:
        Slips, shape ``(samples, 2)`` [m].
    """
    finger = scenario.fingers[index]
    first = _JOINTS * index
    tip = _tip(finger, trace.joint_position[:, first : first + _JOINTS])
    contact, point = (
        spatial_contact(scenario.object, finger),
        _in_object_frame(trace.object_pose, tip),
    )
    if any(contact.curvatures):
        axes = np.array([contact.tangent_x, contact.tangent_y, contact.normal])
        return slips_of(contact.anchor, axes, contact.curvatures, point, _stated(trace, index))
    return (point - np.array(contact.anchor)) @ np.array([contact.tangent_x, contact.tangent_y]).T


def contact_points(scenario: SpatialScenario, trace: Trace, index: int) -> Floats:
    """Recorded slips of a contact, or for a round object its contact points ``(samples, 3)``.

    Args:
        scenario: Scenario of a spatial hand.
        trace: Samples of its run.
        index: The contact.

    Returns:
        Slips ``(samples, 2)``, or points in the frame of the object ``(samples, 3)`` [m].
    """
    if not scenario.object.is_round:
        return _stated(trace, index)
    contact = spatial_contact(scenario.object, scenario.fingers[index])
    axes = np.array([contact.tangent_x, contact.tangent_y, contact.normal])
    points, _ = slide(contact.anchor, axes, contact.curvatures, _stated(trace, index))
    return points


def _stated(trace: Trace, index: int) -> Floats:
    return trace.slip[:, 2 * index : 2 * index + 2]


def _tip(finger: SpatialFinger, angles: Floats) -> Floats:
    """Fingertip from yaw and two pitches, or positions of slides, shape ``(samples, 3)`` [m]."""
    if finger.kind == "slides":
        return np.array(finger.base) + angles
    if finger.kind == "chain":
        return spatial_joint_points(finger, angles)[:, -1]
    yaw, shoulder = angles[:, 0], angles[:, 1]
    elbow = shoulder + angles[:, 2]
    upper, lower = finger.link_lengths
    reach = upper * np.cos(shoulder) + lower * np.cos(elbow)
    height = upper * np.sin(shoulder) + lower * np.sin(elbow)
    offset = np.column_stack([reach * np.cos(yaw), reach * np.sin(yaw), height])
    return np.array(finger.base) + offset


def _in_object_frame(pose: Floats, point: Floats) -> Floats:
    """R^T (p - x), with R from a quaternion (w, x, y, z) of any length."""
    distance, w, axis = point - pose[:, :3], pose[:, 3:4], pose[:, 4:7]
    across = 2.0 * np.cross(distance, axis)
    size = np.sum(pose[:, 3:7] ** 2, axis=1, keepdims=True)
    return distance + (w * across + np.cross(across, axis)) / size
