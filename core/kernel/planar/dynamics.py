"""Finger dynamics at the fingertips, link by link (docs/model.md, Reduced form).

A tip acceleration a (without the bias b) requires the joint torques that correspond to the tip
force f = J^-T (M q'' + h) = Lambda a + f_0, in the inertial frame. Lambda (symmetric) and f_0 are
sums over links of mass times a unit part. The true model, the estimated model and the regressor
share the unit parts.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.links import BY_LINKS, ON_SLIDES, joint_friction
from slipgrasp.core.kernel.planar.chain import chain_heights, chain_unit
from slipgrasp.core.kernel.planar.kinematics import Finger, posture_of, stored_finger
from slipgrasp.core.kernel.planar.state import Y, velocity_at

# Apparent inertia and bias force of the fingers at their tips.
TIP_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, 3)),  # Lambda: xx, xy, yy [kg]
        ("bias", np.float64, (MAX_FINGERS, 2)),  # f_0 [N]
    ],
    align=True,
)

# Apparent inertia [1] and bias force [N/kg] per link mass; indices: finger, link, component.
UNIT_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, 2, 3)),
        ("bias", np.float64, (MAX_FINGERS, 2, 2)),
    ],
    align=True,
)


@compiled
def joint_space_unit(
    hand: Record, i: int, link: int, finger: Finger
) -> tuple[float, float, float, float, float]:
    """Inertia M_11, M_12, M_22 and bias h_1, h_2 of one link with a mass of 1 kg."""
    if hand.kinds[i] == ON_SLIDES:
        return (1.0, 0.0, 1.0, 0.0, hand.gravity) if link == 0 else (0.0, 0.0, 0.0, 0.0, 0.0)
    if hand.kinds[i] != BY_LINKS:
        pose = posture_of(finger)
        return chain_unit(hand.chains[i], link, pose, finger.rate1, finger.rate2, hand.gravity)
    centre, own = hand.link_centres[i, link], hand.link_moments[i, link]
    if link == 0:
        return own, 0.0, 0.0, hand.gravity * centre * finger.cosine1, 0.0
    first, rate1, rate2 = hand.link_lengths[i, 0], finger.rate1, finger.rate2
    weight = hand.gravity * centre * finger.cosine12
    coupling = first * centre * finger.cosine2
    centrifugal = first * centre * finger.sine2
    return (
        first * first + own + 2.0 * coupling,
        own + coupling,
        own,
        hand.gravity * first * finger.cosine1
        + weight
        - centrifugal * (2.0 * rate1 + rate2) * rate2,
        weight + centrifugal * rate1 * rate1,
    )


@compiled
def update_unit_dynamics(hand: Record, kin: Record, unit: Record) -> None:
    """Computes ``unit`` for the positions and velocities in ``kin``."""
    for i in range(hand.num_fingers):
        finger = stored_finger(kin, i)
        for link in range(2):
            m11, m12, m22, h1, h2 = joint_space_unit(hand, i, link, finger)
            bx, by = finger.bias_x, finger.bias_y
            xx, xy, yy, fx, fy = seen_at_tip(finger, m11, m12, m22, h1, h2, bx, by)
            unit.inertia[i, link, 0], unit.inertia[i, link, 1] = xx, xy
            unit.inertia[i, link, 2] = yy
            unit.bias[i, link, 0], unit.bias[i, link, 1] = fx, fy


@compiled
def joint_space(
    hand: Record, masses: Floats, i: int, finger: Finger
) -> tuple[float, float, float, float, float]:
    """Inertia M_11, M_12, M_22 and bias h_1, h_2 of finger ``i``; masses ``(n, 2)`` [kg]."""
    a11, a12, a22, a1, a2 = joint_space_unit(hand, i, 0, finger)
    b11, b12, b22, b1, b2 = joint_space_unit(hand, i, 1, finger)
    a, b = masses[i, 0], masses[i, 1]
    return (
        a * a11 + b * b11,
        a * a12 + b * b12,
        a * a22 + b * b22,
        a * a1 + b * b1,
        a * a2 + b * b2,
    )


@compiled
def seen_at_tip(
    finger: Finger,
    m11: float,
    m12: float,
    m22: float,
    h1: float,
    h2: float,
    bx: float,
    by: float,
) -> tuple[float, float, float, float, float]:
    """Lambda_xx, Lambda_xy, Lambda_yy and f_0 from M and h, for the tip bias b."""
    i00, i01 = finger.inverse00, finger.inverse01
    i10, i11 = finger.inverse10, finger.inverse11
    # Joint accelerations for the tip acceleration b, and the torques they require.
    b1, b2 = i00 * bx + i01 * by, i10 * bx + i11 * by
    t1, t2 = h1 + m11 * b1 + m12 * b2, h2 + m12 * b1 + m22 * b2
    # M J^-1, the joint torques per tip acceleration.
    x1, x2 = m11 * i00 + m12 * i10, m12 * i00 + m22 * i10
    y1, y2 = m11 * i01 + m12 * i11, m12 * i01 + m22 * i11
    return (
        i00 * x1 + i10 * x2,
        i00 * y1 + i10 * y2,
        i01 * y1 + i11 * y2,
        i00 * t1 + i10 * t2,
        i01 * t1 + i11 * t2,
    )


@compiled
def add_joint_friction(hand: Record, kin: Record, total: Record) -> None:
    """Adds joint friction, mapped to the tip by J^-T, to the bias forces f_0."""
    for i in range(hand.num_fingers):
        first = joint_friction(hand, i, kin.joint_velocities[i, 0])
        second = joint_friction(hand, i, kin.joint_velocities[i, 1])
        for axis in range(2):
            total.bias[i, axis] += kin.inverses[i, 0, axis] * first
            total.bias[i, axis] += kin.inverses[i, 1, axis] * second


@compiled
def stored_energy(hand: Record, truth: Record, kin: Record, state: Record) -> tuple[float, float]:
    """Kinetic and potential energy [J] of object and fingers; potential 0 at y = 0."""
    kinetic, potential = 0.0, hand.gravity * truth.object_inertia[0] * state.x[Y]
    for k in range(3):
        rate = state.x[velocity_at(k)]
        kinetic += 0.5 * truth.object_inertia[k] * rate * rate
    for i in range(hand.num_fingers):
        rate1, rate2 = kin.joint_velocities[i, 0], kin.joint_velocities[i, 1]
        if hand.kinds[i] == ON_SLIDES:
            mass = truth.link_masses[i, 0]
            kinetic += 0.5 * mass * (rate1 * rate1 + rate2 * rate2)
            potential += hand.gravity * mass * (hand.bases[i, 1] + kin.links[i, 0, 1])
            continue
        heights = _heights(hand, kin, i)
        for link in range(2):
            mass = truth.link_masses[i, link]
            m11, m12, m22, _, _ = joint_space_unit(hand, i, link, stored_finger(kin, i))
            square = m11 * rate1 * rate1 + 2.0 * m12 * rate1 * rate2 + m22 * rate2 * rate2
            kinetic += 0.5 * mass * square
            potential += hand.gravity * mass * heights[link]
    return kinetic, potential


@compiled
def _heights(hand: Record, kin: Record, i: int) -> tuple[float, float]:
    """Heights of the centres of mass of the links of finger ``i`` [m]."""
    base = hand.bases[i, 1]
    if hand.kinds[i] != BY_LINKS:
        first, second = chain_heights(hand.chains[i], posture_of(stored_finger(kin, i)))
        return base + first, base + second
    joint = base + hand.link_lengths[i, 0] * kin.links[i, 0, 1]
    return (
        base + hand.link_centres[i, 0] * kin.links[i, 0, 1],
        joint + hand.link_centres[i, 1] * kin.links[i, 1, 1],
    )
