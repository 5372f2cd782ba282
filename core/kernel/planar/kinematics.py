"""Planar kinematics of fingers and contacts (docs/model.md, Contact).

A finger on slides has J = 1; its tip position replaces the directions of links. The positions of
prismatic joints of a chain replace cosine and sine of q2.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.loop.links import BY_LINKS, LEAST_SINE, ON_SLIDES
from slipgrasp.core.kernel.numerics.elementary import atan2, sincos, square
from slipgrasp.core.kernel.planar.chain import (
    Posture,
    chain_margin,
    chain_position,
    drift_of,
    lever_of,
    limit_margin,
    pose_chain,
)
from slipgrasp.core.kernel.planar.state import ANGLE, X, Y, slip_at, slip_velocity_at, velocity_at

# State of one finger: link directions, q2, J^-1, joint velocities, tip acceleration at zero joint
# accelerations, and sin^2 q2 minus its minimum. On slides the first direction is the position of
# the tip relative to the base [m], and the rates are the tip velocity [m/s]. Of chains, c2 and s2
# are the positions of prismatic joints [m], and joint limits bound the last number.
Finger = namedtuple(
    "Finger",
    "cosine1 sine1 cosine12 sine12 cosine2 sine2 "
    "inverse00 inverse01 inverse10 inverse11 rate1 rate2 bias_x bias_y extension",
)

# Positions and velocities of fingers and contacts in one state, in the inertial frame.
KINEMATICS = np.dtype(
    [
        ("links", np.float64, (MAX_FINGERS, 2, 2)),  # unit vectors; on slides, tip position
        ("bends", np.float64, (MAX_FINGERS, 2)),  # cosine and sine of q2; slides of a chain [m]
        ("joint_velocities", np.float64, (MAX_FINGERS, 2)),  # [rad/s, m/s]
        ("jacobians", np.float64, (MAX_FINGERS, 2, 2)),  # J of the fingertip
        ("inverses", np.float64, (MAX_FINGERS, 2, 2)),  # J^-1
        ("arms", np.float64, (MAX_FINGERS, 2)),  # r_i, contact relative to the centre of mass [m]
        ("tangents", np.float64, (MAX_FINGERS, 2)),  # t_i = -x_c; the normal n is (t_y, -t_x)
        ("tip_velocities", np.float64, (MAX_FINGERS, 2)),  # [m/s]
        ("bias", np.float64, (MAX_FINGERS, 2)),  # b_i of Eq. 16 [m/s^2]
        ("extension", np.float64, (MAX_FINGERS,)),  # sin^2 q2 minus its minimum
    ],
    align=True,
)


@compiled
def update_kinematics(hand: Record, state: Record, kin: Record) -> None:
    """Fills ``kin`` from pose, slip and their velocities (Eq. 13-16).

    Inverse kinematics on a fixed elbow branch gives the fingers, so the position constraint holds
    to rounding at all times.
    """
    sine, cosine = sincos(state.x[ANGLE])
    omega = state.x[velocity_at(ANGLE)]
    for i in range(hand.num_fingers):
        slip, slip_velocity = state.x[slip_at(i)], state.x[slip_velocity_at(hand.num_fingers, i)]
        tx, ty, rx, ry = place_contact(hand, i, slip, cosine, sine)
        kin.tangents[i, 0], kin.tangents[i, 1] = tx, ty
        kin.arms[i, 0], kin.arms[i, 1] = rx, ry
        vx = state.x[velocity_at(X)] - omega * ry + slip_velocity * tx
        vy = state.x[velocity_at(Y)] + omega * rx + slip_velocity * ty
        kin.tip_velocities[i, 0], kin.tip_velocities[i, 1] = vx, vy
        dx, dy = state.x[X] + rx - hand.bases[i, 0], state.x[Y] + ry - hand.bases[i, 1]
        finger = solve_finger(hand, i, dx, dy, vx, vy)
        _store_finger(hand, i, dx, dy, finger, kin)
        _store_bias(hand, kin, i, finger, omega, slip_velocity)


@compiled
def _store_bias(
    hand: Record, kin: Record, i: int, finger: Finger, omega: float, slip_velocity: float
) -> None:
    rx, ry, tx, ty = kin.arms[i, 0], kin.arms[i, 1], kin.tangents[i, 0], kin.tangents[i, 1]
    kin.bias[i, 0] = finger.bias_x - omega * (omega * rx + 2.0 * slip_velocity * ty)
    kin.bias[i, 1] = finger.bias_y - omega * (omega * ry - 2.0 * slip_velocity * tx)
    if hand.radii[i] > 0.0:
        # Centripetal acceleration of the tip as it follows the circle.
        inwards = square(slip_velocity) / hand.radii[i]
        kin.bias[i, 0] += inwards * ty
        kin.bias[i, 1] -= inwards * tx


@compiled
def mistake_lengths(nominal: Record, state: Record, kin: Record) -> None:
    """Replaces Jacobians and biases with those for the assumed link lengths.

    Args:
        nominal: Model with the assumed lengths.
        state: State to which ``kin`` belongs.
        kin: Up-to-date kinematics; joint angles and rates are not changed.
    """
    omega = state.x[velocity_at(ANGLE)]
    for i in range(nominal.num_fingers):
        if nominal.kinds[i] != BY_LINKS:
            continue
        finger = _mistaken_finger(nominal, kin, i)
        first, second = nominal.link_lengths[i, 0], nominal.link_lengths[i, 1]
        dx = first * finger.cosine1 + second * finger.cosine12
        dy = first * finger.sine1 + second * finger.sine12
        _store_finger(nominal, i, dx, dy, finger, kin)
        slip_velocity = state.x[slip_velocity_at(nominal.num_fingers, i)]
        _store_bias(nominal, kin, i, finger, omega, slip_velocity)


@compiled
def _mistaken_finger(nominal: Record, kin: Record, i: int) -> Finger:
    """Finger ``i`` at its true joint angles and rates, with the assumed lengths."""
    true = stored_finger(kin, i)
    first, second = nominal.link_lengths[i, 0], nominal.link_lengths[i, 1]
    dx = first * true.cosine1 + second * true.cosine12
    dy = first * true.sine1 + second * true.sine12
    scale = 1.0 / (first * second * true.sine2)
    own, total = first * square(true.rate1), second * square(true.rate1 + true.rate2)
    return Finger(
        true.cosine1,
        true.sine1,
        true.cosine12,
        true.sine12,
        true.cosine2,
        true.sine2,
        scale * second * true.cosine12,
        scale * second * true.sine12,
        -scale * dx,
        -scale * dy,
        true.rate1,
        true.rate2,
        own * true.cosine1 + total * true.cosine12,
        own * true.sine1 + total * true.sine12,
        true.extension,
    )


@compiled
def place_contact(
    hand: Record, i: int, slip: float, cosine: float, sine: float
) -> tuple[float, float, float, float]:
    """Tangent and arm (t_x, t_y, r_x, r_y) of contact ``i`` on the turned object."""
    if hand.radii[i] > 0.0:
        return _place_on_circle(hand, i, slip, cosine, sine)
    px = hand.anchors[i, 0] + slip * hand.tangents[i, 0]
    py = hand.anchors[i, 1] + slip * hand.tangents[i, 1]
    return (
        cosine * hand.tangents[i, 0] - sine * hand.tangents[i, 1],
        sine * hand.tangents[i, 0] + cosine * hand.tangents[i, 1],
        cosine * px - sine * py,
        sine * px + cosine * py,
    )


@compiled
def _place_on_circle(
    hand: Record, i: int, slip: float, cosine: float, sine: float
) -> tuple[float, float, float, float]:
    """As `place_contact`, on a circle about the centre of mass, p = -R n."""
    radius = hand.radii[i]
    ox, oy = turn_tangent(hand.tangents[i, 0], hand.tangents[i, 1], slip / radius)
    tx, ty = cosine * ox - sine * oy, sine * ox + cosine * oy
    return tx, ty, -radius * ty, radius * tx


@compiled
def turn_tangent(tx: float, ty: float, angle: float) -> tuple[float, float]:
    """Tangent turned towards its normal by an angle, as by motion along a circle."""
    sine, cosine = sincos(angle)
    return cosine * tx + sine * ty, cosine * ty - sine * tx


@compiled
def solve_finger(hand: Record, i: int, dx: float, dy: float, vx: float, vy: float) -> Finger:
    """Inverse kinematics of finger ``i`` for tip position (dx, dy) and velocity (vx, vy)."""
    if hand.kinds[i] == ON_SLIDES:
        return Finger(dx, dy, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, vx, vy, 0.0, 0.0, 1.0)
    if hand.kinds[i] != BY_LINKS:
        return _solve_chain(hand.chains[i], dx, dy, vx, vy)
    first, second = hand.link_lengths[i, 0], hand.link_lengths[i, 1]
    squared = dx * dx + dy * dy
    c2 = (squared - first * first - second * second) / (2.0 * first * second)
    extension = 1.0 - c2 * c2
    s2 = hand.elbows[i] * np.sqrt(max(extension, 1e-300))
    # (c1, s1) is the rotation from (l1 + l2 c2, l2 s2) to (dx, dy).
    along, across = first + second * c2, second * s2
    inverse = 1.0 / squared
    c1, s1 = (along * dx + across * dy) * inverse, (along * dy - across * dx) * inverse
    c12, s12 = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2
    # The tip is at l2 (c12, s12) from the second joint, and at (dx, dy) from the base.
    scale = 1.0 / (first * second * s2)
    i00, i01 = scale * second * c12, scale * second * s12
    i10, i11 = -scale * dx, -scale * dy
    rate1, rate2 = i00 * vx + i01 * vy, i10 * vx + i11 * vy
    own, total = first * square(rate1), second * square(rate1 + rate2)
    bias_x, bias_y = own * c1 + total * c12, own * s1 + total * s12
    return Finger(
        c1,
        s1,
        c12,
        s12,
        c2,
        s2,
        i00,
        i01,
        i10,
        i11,
        rate1,
        rate2,
        bias_x,
        bias_y,
        extension - square(LEAST_SINE),
    )


@compiled
def _solve_chain(chain: Record, dx: float, dy: float, vx: float, vy: float) -> Finger:
    """As `solve_finger`, for a chain."""
    pose, squared = pose_chain(chain, dx, dy)
    lever = lever_of(chain, pose, chain.tip[0], chain.tip[1])
    scale = 1.0 / (lever.x1 * lever.y2 - lever.x2 * lever.y1)
    i00, i01, i10, i11 = scale * lever.y2, -scale * lever.x2, -scale * lever.y1, scale * lever.x1
    rate1, rate2 = i00 * vx + i01 * vy, i10 * vx + i11 * vy
    ax, ay = drift_of(chain, lever, rate1, rate2)
    margin = chain_margin(chain, pose, squared)
    return Finger(
        pose.cosine1,
        pose.sine1,
        pose.cosine12,
        pose.sine12,
        pose.slide1,
        pose.slide2,
        i00,
        i01,
        i10,
        i11,
        rate1,
        rate2,
        -ax,
        -ay,
        margin,
    )


@compiled
def posture_of(finger: Finger) -> Posture:
    """Posture of a chain."""
    return Posture(
        finger.cosine1,
        finger.sine1,
        finger.cosine12,
        finger.sine12,
        finger.cosine2,
        finger.sine2,
    )


@compiled
def is_at_limit(hand: Record, kin: Record, i: int) -> bool:
    """True if a joint limit, rather than a singularity, bounds the extension of finger ``i``."""
    if hand.kinds[i] in (BY_LINKS, ON_SLIDES) or hand.chains[i].limited == 0:
        return False
    pose = posture_of(stored_finger(kin, i))
    return limit_margin(hand.chains[i], pose) <= kin.extension[i]


@compiled
def _store_finger(hand: Record, i: int, dx: float, dy: float, finger: Finger, kin: Record) -> None:
    """Writes a finger without its bias, and its Jacobian, to ``kin``."""
    second = hand.link_lengths[i, 1]
    kin.links[i, 0, 0], kin.links[i, 0, 1] = finger.cosine1, finger.sine1
    kin.links[i, 1, 0], kin.links[i, 1, 1] = finger.cosine12, finger.sine12
    kin.bends[i, 0], kin.bends[i, 1] = finger.cosine2, finger.sine2
    if hand.kinds[i] != BY_LINKS:
        i00, i01, i10, i11 = finger.inverse00, finger.inverse01, finger.inverse10, finger.inverse11
        scale = 1.0 / (i00 * i11 - i01 * i10)
        kin.jacobians[i, 0, 0], kin.jacobians[i, 0, 1] = scale * i11, 0.0 - scale * i01
        kin.jacobians[i, 1, 0], kin.jacobians[i, 1, 1] = 0.0 - scale * i10, scale * i00
    else:
        kin.jacobians[i, 0, 0], kin.jacobians[i, 0, 1] = -dy, -second * finger.sine12
        kin.jacobians[i, 1, 0], kin.jacobians[i, 1, 1] = dx, second * finger.cosine12
    kin.inverses[i, 0, 0], kin.inverses[i, 0, 1] = finger.inverse00, finger.inverse01
    kin.inverses[i, 1, 0], kin.inverses[i, 1, 1] = finger.inverse10, finger.inverse11
    kin.joint_velocities[i, 0], kin.joint_velocities[i, 1] = finger.rate1, finger.rate2
    kin.extension[i] = finger.extension


@compiled
def stored_finger(kin: Record, i: int) -> Finger:
    """Finger ``i`` from up-to-date kinematics; the bias includes the part of the object."""
    return Finger(
        kin.links[i, 0, 0],
        kin.links[i, 0, 1],
        kin.links[i, 1, 0],
        kin.links[i, 1, 1],
        kin.bends[i, 0],
        kin.bends[i, 1],
        kin.inverses[i, 0, 0],
        kin.inverses[i, 0, 1],
        kin.inverses[i, 1, 0],
        kin.inverses[i, 1, 1],
        kin.joint_velocities[i, 0],
        kin.joint_velocities[i, 1],
        kin.bias[i, 0],
        kin.bias[i, 1],
        kin.extension[i],
    )


@compiled
def joint_position(hand: Record, kin: Record, i: int, joint: int) -> float:
    """Joint angle, of the second joint relative to the first link [rad]; slide position [m]."""
    if hand.kinds[i] == ON_SLIDES:
        return kin.links[i, 0, joint]
    if hand.kinds[i] != BY_LINKS:
        return chain_position(hand.chains[i], posture_of(stored_finger(kin, i)), joint)
    if joint == 0:
        return atan2(kin.links[i, 0, 1], kin.links[i, 0, 0])
    return atan2(kin.bends[i, 1], kin.bends[i, 0])


@compiled
def to_contact_frame(kin: Record, i: int, x: float, y: float) -> tuple[float, float]:
    """C_i^T times a vector: its parts along x_c (tangential) and along n (normal)."""
    tx, ty = kin.tangents[i, 0], kin.tangents[i, 1]
    return -tx * x - ty * y, ty * x - tx * y


@compiled
def to_inertial_frame(kin: Record, i: int, along: float, normal: float) -> tuple[float, float]:
    """C_i times a vector given by its tangential and normal parts."""
    tx, ty = kin.tangents[i, 0], kin.tangents[i, 1]
    return -tx * along + ty * normal, -ty * along - tx * normal
