"""Finger dynamics seen at the contacts, link by link (docs/model.md, Reduced form).

With J_c = C^T J, a finger whose tip has the acceleration a (inertial frame, without the
bias b) needs the contact-frame force f = J_c^-T (M q'' + h) = Lambda a + f_0 from its
joints. Lambda and f_0 are sums over links of mass times a unit part; the unit parts serve
the true model, the believed model and the regressor alike.
"""

from __future__ import annotations

import numpy as np

from core.kernel.compiler import compiled
from core.kernel.records import MAX_FINGERS, Floats, Record

# Apparent inertia and bias force of the fingers at their contacts.
CONTACT_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, 2, 2)),  # Lambda: force per tip acceleration [kg]
        ("bias", np.float64, (MAX_FINGERS, 2)),  # f_0 [N]
    ],
    align=True,
)

# The same for every link with a mass of 1 kg.
UNIT_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, 2, 2, 2)),  # finger, link, contact, inertial axis
        ("bias", np.float64, (MAX_FINGERS, 2, 2)),  # finger, link, contact axis
    ],
    align=True,
)


@compiled
def joint_space_unit(
    hand: Record, kin: Record, i: int, link: int
) -> tuple[float, float, float, float, float]:
    """Inertia M_11, M_12, M_22 and bias h_1, h_2 of one link with a mass of 1 kg."""
    q1, q2 = kin.joint_positions[i, 0], kin.joint_positions[i, 1]
    centre = hand.link_centres[i, link]
    gyration = hand.link_gyrations[i, link]
    if link == 0:
        weight = hand.gravity * centre * np.cos(q1)
        return centre**2 + gyration, 0.0, 0.0, weight, 0.0
    first = hand.link_lengths[i, 0]
    rate1, rate2 = kin.joint_velocities[i, 0], kin.joint_velocities[i, 1]
    coupling = first * centre * np.cos(q2)
    own = centre**2 + gyration
    centrifugal = first * centre * np.sin(q2)
    weight2 = hand.gravity * centre * np.cos(q1 + q2)
    weight1 = hand.gravity * first * np.cos(q1) + weight2
    return (
        first**2 + own + 2.0 * coupling,
        own + coupling,
        own,
        -centrifugal * (2.0 * rate1 * rate2 + rate2**2) + weight1,
        centrifugal * rate1**2 + weight2,
    )


@compiled
def update_unit_dynamics(hand: Record, kin: Record, unit: Record) -> None:
    """Fills ``unit`` for the present positions and velocities."""
    for i in range(hand.num_fingers):
        inverse, frame = kin.inverses[i], kin.frames[i]
        # K = J_c^-T = C^T J^-T takes joint torques to contact forces.
        k00 = frame[0, 0] * inverse[0, 0] + frame[1, 0] * inverse[0, 1]
        k01 = frame[0, 0] * inverse[1, 0] + frame[1, 0] * inverse[1, 1]
        k10 = frame[0, 1] * inverse[0, 0] + frame[1, 1] * inverse[0, 1]
        k11 = frame[0, 1] * inverse[1, 0] + frame[1, 1] * inverse[1, 1]
        for link in range(2):
            m11, m12, m22, h1, h2 = joint_space_unit(hand, kin, i, link)
            for axis in range(2):
                j1 = m11 * inverse[0, axis] + m12 * inverse[1, axis]
                j2 = m12 * inverse[0, axis] + m22 * inverse[1, axis]
                unit.inertia[i, link, 0, axis] = k00 * j1 + k01 * j2
                unit.inertia[i, link, 1, axis] = k10 * j1 + k11 * j2
            b0, b1 = kin.bias[i, 0], kin.bias[i, 1]
            for axis in range(2):
                force = k00 * h1 + k01 * h2 if axis == 0 else k10 * h1 + k11 * h2
                inertial = unit.inertia[i, link, axis, 0] * b0 + unit.inertia[i, link, axis, 1] * b1
                unit.bias[i, link, axis] = force + inertial


@compiled
def combine_links(truth: Record, unit: Record, total: Record) -> None:
    """Sums the links of every finger, weighted with their masses, into ``total``."""
    for i in range(truth.num_fingers):
        first, second = truth.link_masses[i, 0], truth.link_masses[i, 1]
        for row in range(2):
            total.bias[i, row] = first * unit.bias[i, 0, row] + second * unit.bias[i, 1, row]
            for axis in range(2):
                total.inertia[i, row, axis] = (
                    first * unit.inertia[i, 0, row, axis] + second * unit.inertia[i, 1, row, axis]
                )


@compiled
def stored_energy(hand: Record, truth: Record, kin: Record, state: Floats) -> tuple[float, float]:
    """Kinetic and potential energy [J] of object and fingers, heights from y = 0."""
    body = truth.object_inertia
    kinetic = 0.5 * (body[0] * state[3] ** 2 + body[1] * state[4] ** 2 + body[2] * state[5] ** 2)
    potential = hand.gravity * body[0] * state[1]
    for i in range(hand.num_fingers):
        q1 = kin.joint_positions[i, 0]
        q12 = q1 + kin.joint_positions[i, 1]
        rate1, rate2 = kin.joint_velocities[i, 0], kin.joint_velocities[i, 1]
        base = hand.bases[i, 1]
        heights = (
            base + hand.link_centres[i, 0] * np.sin(q1),
            base + hand.link_lengths[i, 0] * np.sin(q1) + hand.link_centres[i, 1] * np.sin(q12),
        )
        for link in range(2):
            m11, m12, m22, _, _ = joint_space_unit(hand, kin, i, link)
            square = m11 * rate1**2 + 2.0 * m12 * rate1 * rate2 + m22 * rate2**2
            kinetic += 0.5 * truth.link_masses[i, link] * square
            potential += hand.gravity * truth.link_masses[i, link] * heights[link]
    return kinetic, potential
