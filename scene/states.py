"""Samples of a trace in three dimensions, for planar and spatial hands."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace
from slipgrasp.scene import rotations
from slipgrasp.scene.rotations import Values

_Z = np.array([0.0, 0.0, 1.0])
_LARGEST = 1e100


class States(NamedTuple):
    """Hand, object and contacts at some instants, SI units.

    Attributes:
        times: The instants, shape ``(n,)`` [s].
        object_pose: Position and unit quaternion (w, x, y, z), shape ``(n, 7)``.
        desired_pose: Desired position and unit quaternion (w, x, y, z), shape ``(n, 7)``.
        joint_positions: Joint positions, shape ``(n, fingers, joints)`` [rad, m].
        slip: Slips along the d - 1 tangents, shape ``(n, contacts, d - 1)`` [m].
        slip_velocity: Slip velocities, shape ``(n, contacts, d - 1)`` [m/s].
        tangential_force: Force of each fingertip on the object, shape ``(n, contacts, d - 1)`` [N].
        normal_force: Normal forces, shape ``(n, contacts)`` [N].
        friction: Friction coefficients, shape ``(n, contacts)``.
        phases: Numbers of the phases, shape ``(n, contacts)``.
        spin: Rotation angles of soft fingertips, shape ``(n, contacts)`` [rad].
        torsional_moment: Moments on the object about its outward normals, ``(n, contacts)`` [N m].
    """

    times: Values
    object_pose: Values
    desired_pose: Values
    joint_positions: Values
    slip: Values
    slip_velocity: Values
    tangential_force: Values
    normal_force: Values
    friction: Values
    phases: NDArray[np.int8]
    spin: Values
    torsional_moment: Values


def states_of(samples: Trace) -> States:
    """One state for each row of a trace.

    Args:
        samples: The rows, of a planar or a spatial hand.
    """
    shape, n = samples.shape, len(samples)
    contacts, tangents = shape.num_contacts, shape.space.num_tangents
    actual = in_three_dimensions(samples.object_pose)
    desired = _desired(samples.object_pose, samples.tracking_error)
    return States(
        times=samples.times,
        object_pose=actual,
        desired_pose=desired,
        joint_positions=samples.joint_position.reshape(
            n, shape.num_jointed, shape.joints_per_finger
        ),
        slip=samples.slip.reshape(n, contacts, tangents),
        slip_velocity=samples.slip_velocity.reshape(n, contacts, tangents),
        tangential_force=samples.tangential_force.reshape(n, contacts, tangents),
        normal_force=samples.normal_force,
        friction=samples.friction_coefficient,
        phases=samples.phase,
        spin=of_pads(samples.spin, contacts),
        torsional_moment=of_pads(samples.torsional_moment, contacts),
    )


def states_at(trace: Trace, times: Values) -> States:
    """States at given times, by linear interpolation between the rows of a trace.

    Args:
        trace: A run.
        times: Ascending times within it, shape ``(n,)`` [s].
    """
    rows = drawable(trace.to_rows())
    last = np.searchsorted(trace.times, times, side="right") - 1
    between = [np.interp(times, trace.times, column) for column in rows.T]
    states = states_of(Trace.from_rows(trace.shape, np.stack(between, axis=1)))
    held = states_of(Trace.from_rows(trace.shape, rows[last]))
    return states._replace(friction=held.friction, phases=held.phases)


def of_pads(values: Values, contacts: int) -> Values:
    """A signal of soft fingertips ``(n, contacts)``; 0 if a hand has none."""
    return values if values.shape[-1] else np.zeros((*values.shape[:-1], contacts))


def drawable(values: NDArray[Any]) -> NDArray[Any]:
    """Limits numbers to a range that can be drawn, because those in a file may be extreme."""
    return values.clip(-_LARGEST, _LARGEST)


def in_three_dimensions(poses: Values) -> Values:
    """Converts poses (x, y, theta) in the plane z = 0, or with any quaternion, to ``(n, 7)``."""
    found = np.zeros_like(poses, shape=(len(poses), 7))
    if poses.shape[1] == 1:  # along a rail
        found[:, :1], found[:, 3] = poses, 1.0
        return found
    if poses.shape[1] == 3:
        found[:, :2] = poses[:, :2]
        found[:, 3:] = rotations.about(_Z, poses[:, 2])
        return found
    found[:, :3] = poses[:, :3]
    found[:, 3:] = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return found


def _desired(pose: Values, error: Values) -> Values:
    """Desired poses; errors of the attitude are rotation vectors in world axes."""
    if pose.shape == error.shape:
        return in_three_dimensions(pose + error)
    actual = in_three_dimensions(pose)
    turned = rotations.product(rotations.from_vectors(error[:, 3:]), actual[:, 3:])
    return np.hstack([actual[:, :3] + error[:, :3], turned])
