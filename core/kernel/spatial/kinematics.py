"""Kinematics of the fingers and contacts of spatial hands (docs/space.md, Contact).

All vectors are in world axes. A finger of links is a planar finger of two links in a vertical plane
that rotates about a vertical yaw axis; its axes are radial, azimuth (across the plane) and up. A
finger on slides moves its tip along x, y and z: J = 1, and it is never singular. For chains of
joints see `slipgrasp.core.kernel.spatial.chain`.
"""

from __future__ import annotations

import numpy as np
from numba import types
from numpy.typing import NDArray

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.links import BY_CHAIN, BY_LINKS, LEAST_SINE, ON_SLIDES
from slipgrasp.core.kernel.numerics.elementary import atan2, square
from slipgrasp.core.kernel.spatial.chain import (
    CHAIN_STATE,
    SEED,
    chain_turning,
    move_chain,
    solve_chain,
)
from slipgrasp.core.kernel.spatial.chain_dynamics import moment_at_chain
from slipgrasp.core.kernel.spatial.curved_faces import FLAT, bend_bias, follow_face
from slipgrasp.core.kernel.spatial.model import HAND
from slipgrasp.core.kernel.spatial.state import (
    ATTITUDE,
    POSITION,
    SPIN,
    VELOCITY,
    slip_at,
    slip_velocity_at,
)

# Positions and velocities of object, contacts and fingers in one state.
KINEMATICS = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),  # R(Q)
        ("arms", np.float64, (MAX_FINGERS, 3)),  # r_i, contact relative to the centre of mass [m]
        ("frames", np.float64, (MAX_FINGERS, 3, 3)),  # t_x, t_y, n; C = [-t_x, -t_y, n]
        ("tip_velocities", np.float64, (MAX_FINGERS, 3)),  # [m/s]
        # w x (w x r) + 2 w x R T s', and R T' s' on a curved face [m/s^2]
        ("bias", np.float64, (MAX_FINGERS, 3)),
        ("curvature", np.float64, (MAX_FINGERS, 3)),  # J' q' [m/s^2]
        ("yaws", np.float64, (MAX_FINGERS, 2)),  # cosine and sine of q1
        ("links", np.float64, (MAX_FINGERS, 2, 2)),  # link directions in the plane of the finger
        ("bends", np.float64, (MAX_FINGERS, 2)),  # cosine and sine of q3
        ("reaches", np.float64, (MAX_FINGERS, 2)),  # of the tip from the base: radius, height [m]
        ("inverses", np.float64, (MAX_FINGERS, 2, 2)),  # of the planar Jacobian
        (
            "positions",
            np.float64,
            (MAX_FINGERS, 3),
        ),  # of slides, and coordinates of chains [m, rad]
        ("chains", CHAIN_STATE, (MAX_FINGERS,)),
        ("rates", np.float64, (MAX_FINGERS, 3)),  # q' [rad/s, m/s]
        # sin^2 q3 minus its minimum; of chains the margin of `solve_chain`, of slides 1
        ("extension", np.float64, (MAX_FINGERS,)),
        # tip radius minus its minimum [m]; of chains and slides 1
        ("clearance", np.float64, (MAX_FINGERS,)),
    ],
    align=True,
)


# Chains and curved faces are compiled separately: inlined in the loop over contacts, they would
# slow down every hand and be compiled into each caller.
@compiled_apart(types.void, HAND, SEED, types.int64, *(types.float64,) * 3, KINEMATICS)
def spatial_solve_chain(
    hand: Record, seed: Record, i: int, dx: float, dy: float, dz: float, kin: Record
) -> None:
    """Inverse kinematics of chain ``i`` for the tip position (dx, dy, dz) from the base."""
    chain, now, rates = hand.chains[i], kin.chains[i], kin.rates[i]
    now.target[0], now.target[1], now.target[2] = dx, dy, dz
    kin.extension[i] = solve_chain(chain, now.target, seed, kin.positions[i], now)
    kin.clearance[i] = 1.0
    for k in range(3):
        rates[k] = 0.0
        for c in range(3):
            rates[k] += now.inverse[k, c] * kin.tip_velocities[i, c]
    move_chain(chain, rates, now, kin.curvature[i])


@compiled_apart(types.void, HAND, types.int64, *(types.float64,) * 2, KINEMATICS)
def spatial_follow_face(hand: Record, i: int, first: float, second: float, kin: Record) -> None:
    """Maps contact ``i``, at the given slips, to its curved face."""
    face, radius = hand.curved_faces[i], hand.radii[i]
    follow_face(face, radius, first, second, kin.frames[i], kin.arms[i])


@compiled_apart(types.void, HAND, types.int64, *(types.float64,) * 4, KINEMATICS)
def spatial_bend_bias(
    hand: Record,
    i: int,
    first: float,
    second: float,
    speed_x: float,
    speed_y: float,
    kin: Record,
) -> None:
    """Adds the acceleration due to the curvature of the face of contact ``i``."""
    slips, speeds = (first, second), (speed_x, speed_y)
    face, radius = hand.curved_faces[i], hand.radii[i]
    bend_bias(face, radius, slips, speeds, kin.frames[i], kin.bias[i])


@compiled
def rotate(quaternion: Floats, at: int, rotation: Floats) -> None:
    """Computes R(Q) of the unit quaternion that starts at ``quaternion[at]``."""
    w, x, y, z = quaternion[at], quaternion[at + 1], quaternion[at + 2], quaternion[at + 3]
    rotation[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    rotation[0, 1] = 2.0 * (x * y - w * z)
    rotation[0, 2] = 2.0 * (x * z + w * y)
    rotation[1, 0] = 2.0 * (x * y + w * z)
    rotation[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    rotation[1, 2] = 2.0 * (y * z - w * x)
    rotation[2, 0] = 2.0 * (x * z - w * y)
    rotation[2, 1] = 2.0 * (y * z + w * x)
    rotation[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@compiled
def update_kinematics(hand: Record, seeds: NDArray[np.void], state: Record, kin: Record) -> None:
    """Fills ``kin`` from pose, slips and their velocities.

    Inverse kinematics on fixed branches gives the fingers, so the position constraint holds to
    rounding at all times.

    Args:
        hand: Geometry.
        seeds: Initial guesses of the joint positions of chains, ``(n,)``.
        state: State.
        kin: Output.
    """
    x, n = state.x, hand.num_fingers
    rotate(x, ATTITUDE, kin.rotation)
    turn = kin.rotation
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    for i in range(n):
        for row in range(3):
            for c in range(3):
                total = 0.0
                for k in range(3):
                    total += turn[c, k] * hand.frames[i, row, k]
                kin.frames[i, row, c] = total
        first, second = x[slip_at(i, 0)], x[slip_at(i, 1)]
        speed_x, speed_y = x[slip_velocity_at(n, i, 0)], x[slip_velocity_at(n, i, 1)]
        for c in range(3):
            total = first * kin.frames[i, 0, c] + second * kin.frames[i, 1, c]
            for k in range(3):
                total += turn[c, k] * hand.anchors[i, k]
            kin.arms[i, c] = total
        if hand.curved_faces[i] != FLAT:
            spatial_follow_face(hand, i, first, second, kin)
        rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
        ux = speed_x * kin.frames[i, 0, 0] + speed_y * kin.frames[i, 1, 0]
        uy = speed_x * kin.frames[i, 0, 1] + speed_y * kin.frames[i, 1, 1]
        uz = speed_x * kin.frames[i, 0, 2] + speed_y * kin.frames[i, 1, 2]
        cx, cy, cz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
        kin.tip_velocities[i, 0] = x[VELOCITY] + cx + ux
        kin.tip_velocities[i, 1] = x[VELOCITY + 1] + cy + uy
        kin.tip_velocities[i, 2] = x[VELOCITY + 2] + cz + uz
        gx, gy, gz = cx + 2.0 * ux, cy + 2.0 * uy, cz + 2.0 * uz
        kin.bias[i, 0] = wy * gz - wz * gy
        kin.bias[i, 1] = wz * gx - wx * gz
        kin.bias[i, 2] = wx * gy - wy * gx
        if hand.curved_faces[i] != FLAT:
            spatial_bend_bias(hand, i, first, second, speed_x, speed_y, kin)
        dx = x[POSITION] + rx - hand.bases[i, 0]
        dy = x[POSITION + 1] + ry - hand.bases[i, 1]
        dz = x[POSITION + 2] + rz - hand.bases[i, 2]
        if hand.kinds[i] == BY_LINKS:
            _solve_links(hand, i, dx, dy, dz, kin)
        elif hand.kinds[i] == ON_SLIDES:
            _solve_slides(i, dx, dy, dz, kin)
        else:
            spatial_solve_chain(hand, seeds[i], i, dx, dy, dz, kin)


@compiled
def _solve_slides(i: int, dx: float, dy: float, dz: float, kin: Record) -> None:
    """Sets the slides of finger ``i`` for the tip position (dx, dy, dz) from the base."""
    kin.positions[i, 0], kin.positions[i, 1], kin.positions[i, 2] = dx, dy, dz
    for c in range(3):
        kin.rates[i, c], kin.curvature[i, c] = kin.tip_velocities[i, c], 0.0
    kin.extension[i] = kin.clearance[i] = 1.0


@compiled
def _solve_links(hand: Record, i: int, dx: float, dy: float, dz: float, kin: Record) -> None:
    """Inverse kinematics of finger ``i`` for the tip position (dx, dy, dz) from the base."""
    first, second = hand.link_lengths[i, 0], hand.link_lengths[i, 1]
    radius = np.sqrt(dx * dx + dy * dy)
    cosine, sine = dx / radius, dy / radius
    vx, vy, vz = kin.tip_velocities[i, 0], kin.tip_velocities[i, 1], kin.tip_velocities[i, 2]
    outwards, across = cosine * vx + sine * vy, cosine * vy - sine * vx
    squared = radius * radius + dz * dz
    c2 = (squared - first * first - second * second) / (2.0 * first * second)
    extension = 1.0 - c2 * c2
    s2 = hand.elbows[i] * np.sqrt(max(extension, 1e-300))
    along, beside = first + second * c2, second * s2
    inverse = 1.0 / squared
    c1, s1 = (along * radius + beside * dz) * inverse, (along * dz - beside * radius) * inverse
    c12, s12 = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2
    scale = 1.0 / (first * second * s2)
    i00, i01 = scale * second * c12, scale * second * s12
    i10, i11 = -scale * radius, -scale * dz
    yaw = across / radius
    rate1, rate2 = i00 * outwards + i01 * vz, i10 * outwards + i11 * vz
    own, total = first * square(rate1), second * square(rate1 + rate2)
    inwards = -(own * c1 + total * c12) - radius * square(yaw)
    sideways = 2.0 * outwards * yaw
    kin.curvature[i, 0] = cosine * inwards - sine * sideways
    kin.curvature[i, 1] = sine * inwards + cosine * sideways
    kin.curvature[i, 2] = -(own * s1 + total * s12)
    kin.yaws[i, 0], kin.yaws[i, 1] = cosine, sine
    kin.links[i, 0, 0], kin.links[i, 0, 1] = c1, s1
    kin.links[i, 1, 0], kin.links[i, 1, 1] = c12, s12
    kin.bends[i, 0], kin.bends[i, 1] = c2, s2
    kin.reaches[i, 0], kin.reaches[i, 1] = radius, dz
    kin.inverses[i, 0, 0], kin.inverses[i, 0, 1] = i00, i01
    kin.inverses[i, 1, 0], kin.inverses[i, 1, 1] = i10, i11
    kin.rates[i, 0], kin.rates[i, 1], kin.rates[i, 2] = yaw, rate1, rate2
    kin.extension[i] = extension - square(LEAST_SINE)
    kin.clearance[i] = radius - hand.least_radii[i]


@compiled
def joint_position(hand: Record, kin: Record, i: int, joint: int) -> float:
    """Joint position: yaw, pitch, pitch relative to the first link [rad].

    For slides and chains, the coordinate [m, rad].
    """
    if hand.kinds[i] != BY_LINKS:
        return kin.positions[i, joint]
    if joint == 0:
        return atan2(kin.yaws[i, 1], kin.yaws[i, 0])
    if joint == 1:
        return atan2(kin.links[i, 0, 1], kin.links[i, 0, 0])
    return atan2(kin.bends[i, 1], kin.bends[i, 0])


@compiled
def tip_turning(
    hand: Record, kin: Record, i: int
) -> tuple[float, float, float, float, float, float]:
    """Angular velocity of fingertip ``i`` [rad/s], and J_omega' q' [rad/s^2], world axes.

    A finger of links rotates about z with its yaw and about u x z with its pitches,
    u = (cos q1, sin q1, 0); a finger on slides does not rotate.
    """
    if hand.kinds[i] == ON_SLIDES:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if hand.kinds[i] == BY_CHAIN:
        return chain_turning(hand.chains[i], kin.chains[i])
    cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
    yaw, pitch = kin.rates[i, 0], kin.rates[i, 1] + kin.rates[i, 2]
    return pitch * sine, -pitch * cosine, yaw, yaw * pitch * cosine, yaw * pitch * sine, 0.0


@compiled
def moment_at_tip(
    hand: Record, kin: Record, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Tip force J^-T J_omega^T m that requires the same joint torques as a moment m at the tip."""
    if hand.kinds[i] == ON_SLIDES:
        return 0.0, 0.0, 0.0
    if hand.kinds[i] == BY_CHAIN:
        return moment_at_chain(hand.chains[i], kin.chains[i], x, y, z)
    cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
    across, pitch = z / kin.reaches[i, 0], sine * x - cosine * y
    outwards = (kin.inverses[i, 0, 0] + kin.inverses[i, 1, 0]) * pitch
    upwards = (kin.inverses[i, 0, 1] + kin.inverses[i, 1, 1]) * pitch
    return cosine * outwards - sine * across, sine * outwards + cosine * across, upwards


@compiled
def torques_to_forces(hand: Record, kin: Record, torques: Floats, forces: Floats) -> None:
    """Computes u = J^-T tau for every finger, ``(n, 3)`` to ``(n, 3)``."""
    for i in range(hand.num_fingers):
        if hand.kinds[i] == ON_SLIDES:
            for c in range(3):
                forces[i, c] = torques[i, c]
            continue
        if hand.kinds[i] == BY_CHAIN:
            inverse, t0, t1, t2 = kin.chains[i].inverse, torques[i, 0], torques[i, 1], torques[i, 2]
            for c in range(3):
                forces[i, c] = inverse[0, c] * t0 + inverse[1, c] * t1 + inverse[2, c] * t2
            continue
        across = torques[i, 0] / kin.reaches[i, 0]
        first, second = torques[i, 1], torques[i, 2]
        outwards = kin.inverses[i, 0, 0] * first + kin.inverses[i, 1, 0] * second
        cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
        forces[i, 0] = cosine * outwards - sine * across
        forces[i, 1] = sine * outwards + cosine * across
        forces[i, 2] = kin.inverses[i, 0, 1] * first + kin.inverses[i, 1, 1] * second


@compiled
def forces_to_torques(hand: Record, kin: Record, forces: Floats, torques: Floats) -> None:
    """Computes tau = J^T u for every finger, ``(n, 3)`` to ``(n, 3)``."""
    for i in range(hand.num_fingers):
        if hand.kinds[i] == ON_SLIDES:
            for c in range(3):
                torques[i, c] = forces[i, c]
            continue
        if hand.kinds[i] == BY_CHAIN:
            jacobian, fx, fy, fz = kin.chains[i].jacobian, forces[i, 0], forces[i, 1], forces[i, 2]
            for k in range(3):
                torques[i, k] = jacobian[0, k] * fx + jacobian[1, k] * fy + jacobian[2, k] * fz
            continue
        cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
        outwards = cosine * forces[i, 0] + sine * forces[i, 1]
        across = cosine * forces[i, 1] - sine * forces[i, 0]
        radius, height, second = kin.reaches[i, 0], kin.reaches[i, 1], hand.link_lengths[i, 1]
        torques[i, 0] = radius * across
        torques[i, 1] = radius * forces[i, 2] - height * outwards
        torques[i, 2] = second * (kin.links[i, 1, 0] * forces[i, 2] - kin.links[i, 1, 1] * outwards)
