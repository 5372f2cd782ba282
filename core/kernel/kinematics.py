"""Planar kinematics of fingers and contacts (docs/model.md, Contact geometry)."""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.records import MAX_FINGERS, Floats, Record

LEAST_SINE = 1e-3


# Positions and velocities of fingers and contacts in one state.
KINEMATICS = np.dtype(
    [
        ("joint_positions", np.float64, (MAX_FINGERS, 2)),  # q [rad]
        ("joint_velocities", np.float64, (MAX_FINGERS, 2)),  # [rad/s]
        ("jacobians", np.float64, (MAX_FINGERS, 2, 2)),  # J of the fingertip, inertial frame
        ("inverses", np.float64, (MAX_FINGERS, 2, 2)),  # J^-1
        ("frames", np.float64, (MAX_FINGERS, 2, 2)),  # C_i = R [x_c n], columns
        ("arms", np.float64, (MAX_FINGERS, 2)),  # r_i, contact relative to the centre of mass [m]
        ("tangents", np.float64, (MAX_FINGERS, 2)),  # t_i, inertial frame
        ("moments", np.float64, (MAX_FINGERS, 2)),  # third row of W_i: r_i x C_i [m]
        ("tip_velocities", np.float64, (MAX_FINGERS, 2)),  # [m/s]
        ("bias", np.float64, (MAX_FINGERS, 2)),  # b_i of Eq. 16 [m/s^2]
        ("extension", np.float64, (MAX_FINGERS,)),  # sin^2 q2 less its least allowed value
    ],
    align=True,
)


@compiled
def update_kinematics(hand: Record, state: Floats, kin: Record) -> None:
    """Fills ``kin`` from pose, slip and their velocities (Eq. 13-16).

    Joint angles follow from inverse kinematics on a fixed elbow branch, so the position
    constraint holds to rounding at all times.
    """
    n = hand.num_fingers
    cosine, sine = np.cos(state[2]), np.sin(state[2])
    omega = state[5]
    for i in range(n):
        slip, slip_velocity = state[6 + i], state[6 + n + i]
        tx = cosine * hand.tangents[i, 0] - sine * hand.tangents[i, 1]
        ty = sine * hand.tangents[i, 0] + cosine * hand.tangents[i, 1]
        px = hand.anchors[i, 0] + slip * hand.tangents[i, 0]
        py = hand.anchors[i, 1] + slip * hand.tangents[i, 1]
        rx, ry = cosine * px - sine * py, sine * px + cosine * py
        kin.tangents[i, 0], kin.tangents[i, 1] = tx, ty
        kin.arms[i, 0], kin.arms[i, 1] = rx, ry
        kin.frames[i, 0, 0], kin.frames[i, 1, 0] = -tx, -ty
        kin.frames[i, 0, 1], kin.frames[i, 1, 1] = ty, -tx
        kin.moments[i, 0] = -rx * ty + ry * tx
        kin.moments[i, 1] = -rx * tx - ry * ty
        kin.tip_velocities[i, 0] = state[3] - omega * ry + slip_velocity * tx
        kin.tip_velocities[i, 1] = state[4] + omega * rx + slip_velocity * ty
        kin.bias[i, 0] = -(omega**2) * rx - 2.0 * omega * slip_velocity * ty
        kin.bias[i, 1] = -(omega**2) * ry + 2.0 * omega * slip_velocity * tx
        _solve_finger(hand, i, state[0] + rx, state[1] + ry, kin)


@compiled
def _solve_finger(hand: Record, i: int, tip_x: float, tip_y: float, kin: Record) -> None:
    """Inverse kinematics of finger ``i``; completes ``bias`` with the finger's own part."""
    first, second = hand.link_lengths[i, 0], hand.link_lengths[i, 1]
    dx, dy = tip_x - hand.bases[i, 0], tip_y - hand.bases[i, 1]
    c2 = (dx * dx + dy * dy - first**2 - second**2) / (2.0 * first * second)
    square = 1.0 - c2 * c2
    kin.extension[i] = square - LEAST_SINE**2
    s2 = hand.elbows[i] * np.sqrt(max(square, 1e-300))
    # The first link points along the rotation that takes (l1 + l2 c2, l2 s2) to (dx, dy).
    along, across = first + second * c2, second * s2
    squared = dx * dx + dy * dy
    c1, s1 = (along * dx + across * dy) / squared, (along * dy - across * dx) / squared
    c12, s12 = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2
    kin.joint_positions[i, 0] = np.arctan2(s1, c1)
    kin.joint_positions[i, 1] = np.arctan2(s2, c2)
    j00, j01 = -first * s1 - second * s12, -second * s12
    j10, j11 = first * c1 + second * c12, second * c12
    kin.jacobians[i, 0, 0], kin.jacobians[i, 0, 1] = j00, j01
    kin.jacobians[i, 1, 0], kin.jacobians[i, 1, 1] = j10, j11
    determinant = first * second * s2
    i00, i01 = j11 / determinant, -j01 / determinant
    i10, i11 = -j10 / determinant, j00 / determinant
    kin.inverses[i, 0, 0], kin.inverses[i, 0, 1] = i00, i01
    kin.inverses[i, 1, 0], kin.inverses[i, 1, 1] = i10, i11
    vx, vy = kin.tip_velocities[i, 0], kin.tip_velocities[i, 1]
    rate1, rate2 = i00 * vx + i01 * vy, i10 * vx + i11 * vy
    kin.joint_velocities[i, 0], kin.joint_velocities[i, 1] = rate1, rate2
    total = rate1 + rate2
    kin.bias[i, 0] += first * c1 * rate1**2 + second * c12 * total**2
    kin.bias[i, 1] += first * s1 * rate1**2 + second * s12 * total**2
