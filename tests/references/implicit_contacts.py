"""Motion of a hand whose tips are points on an implicit surface, with nothing eliminated.

No coordinate of slip and no curvature occurs here: a tip at d in the frame of the object obeys
d K d = R^2 with a constant K (the identity for a circle and a sphere, without the axis for a
cylinder), differentiated twice, and friction acts along the relative velocity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Tip(NamedTuple):
    """A finger and its tip, in an inertial frame of dimension d; its finger has d joints."""

    inertia: Array  # M, (d, d)
    bias: Array  # h, (d,)
    jacobian: Array  # (d, d)
    drift: Array  # J' q', (d,)
    position: Array  # from the centre of mass of the object, (d,) [m]
    velocity: Array  # (d,) [m/s]
    torques: Array  # (d,)
    friction: float
    slips: bool


class Body(NamedTuple):
    """The object, of k coordinates."""

    inertia: Array  # (k, k)
    bias: Array  # (k,)
    rotation: Array  # R, (d, d)
    spin: Array  # the matrix of w x, (d, d)
    velocity: Array  # of its centre of mass, (d,)
    load: Array  # (k,)


class Motion(NamedTuple):
    """Accelerations and forces."""

    joint_accelerations: Array  # (n, d)
    acceleration: Array  # (k,)
    forces: Array  # on the object, inertial frame, (n, d) [N]
    speed_rates: Array  # of |relative velocity| where a tip slips, 0 where it sticks, (n,) [m/s^2]


def point_matrix(position: Array) -> Array:
    """From the velocities of the object to that of its point at a position, ``(d, k)``."""
    if len(position) == 2:
        return np.array([[1.0, 0.0, -position[1]], [0.0, 1.0, position[0]]])
    turning = [np.cross(axis, position) for axis in np.eye(3)]
    return np.column_stack((np.eye(3), *turning))


def solve_motion(tips: list[Tip], body: Body, K: Array) -> Motion:
    """Solves for joint and object accelerations and contact forces at once.

    Args:
        tips: The fingers.
        body: The object.
        K: Of the surface, object frame, ``(d, d)``.
    """
    n, d, k = len(tips), len(K), len(body.bias)
    size = 2 * n * d + k
    matrix, right = np.zeros((size, size)), np.zeros(size)
    whole = slice(n * d, n * d + k)
    matrix[whole, whole], right[whole] = body.inertia, body.load - body.bias
    rates = []
    for i, tip in enumerate(tips):
        joints, force = slice(i * d, (i + 1) * d), slice(n * d + k + i * d, n * d + k + (i + 1) * d)
        at_point = point_matrix(tip.position)
        matrix[joints, joints], matrix[joints, force] = tip.inertia, tip.jacobian.T
        right[joints] = tip.torques - tip.bias
        matrix[whole, force] = -at_point.T
        # Rows (d, size) of the acceleration of the tip relative to the object, as seen from it.
        row, known = np.zeros((d, size)), np.zeros(d)
        row[:, joints], row[:, whole] = tip.jacobian, -at_point
        moving = tip.velocity - body.velocity
        relative = moving - body.spin @ tip.position
        known = tip.drift - body.spin @ moving - body.spin @ relative
        turned = body.rotation.T
        place, velocity = turned @ tip.position, turned @ relative
        inward = -body.rotation @ (K @ place)
        inward /= np.linalg.norm(inward)
        equations, values = matrix[force], right[force]
        equations[0] = place @ K @ turned @ row
        values[0] = -(place @ K @ turned @ known) - velocity @ K @ velocity
        for line, tangent in enumerate(_across(inward), start=1):
            if tip.slips:
                along = relative / np.linalg.norm(relative)
                equations[line, force] = tangent - tip.friction * (tangent @ along) * inward
            else:
                equations[line], values[line] = tangent @ row, -(tangent @ known)
        rates.append((relative, row, known))
    solution = np.linalg.solve(matrix, right)
    return Motion(
        solution[: n * d].reshape(n, d),
        solution[whole],
        solution[n * d + k :].reshape(n, d),
        np.array(
            [
                (v @ (row @ solution + known)) / np.linalg.norm(v) if tip.slips else 0.0
                for (v, row, known), tip in zip(rates, tips, strict=True)
            ]
        ),
    )


def _across(normal: Array) -> Array:
    """Unit vectors across a normal and each other, as rows."""
    return np.linalg.svd(normal[None, :])[2][1:]
