"""Common functions of links and joints of planar and spatial fingers."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record

BY_LINKS, ON_SLIDES, BY_CHAIN = range(3)  # kinds of fingers
REST_RATE = 0.01  # joint rate below which dry friction decreases smoothly [rad/s]
LEAST_SINE = 1e-2  # least |sin q2|; closer to a straight or folded finger, rounding dominates


@compiled
def combine_links(truth: Record, unit: Record, total: Record) -> None:
    """Sums the links of every finger, weighted by their masses, into ``total``."""
    for i in range(truth.num_fingers):
        first, second = truth.link_masses[i, 0], truth.link_masses[i, 1]
        for k in range(total.inertia.shape[1]):
            total.inertia[i, k] = first * unit.inertia[i, 0, k] + second * unit.inertia[i, 1, k]
        for k in range(total.bias.shape[1]):
            total.bias[i, k] = first * unit.bias[i, 0, k] + second * unit.bias[i, 1, k]
        for link in range(2, unit.inertia.shape[1]):
            mass = truth.link_masses[i, link]
            if mass != 0.0:
                for k in range(total.inertia.shape[1]):
                    total.inertia[i, k] += mass * unit.inertia[i, link, k]
                for k in range(total.bias.shape[1]):
                    total.bias[i, k] += mass * unit.bias[i, link, k]


@compiled
def joint_friction(hand: Record, i: int, rate: float) -> float:
    """Friction torque on a joint of finger ``i`` at a given rate [N m].

    Viscous and dry friction; the latter is smooth at rest, so that no joint sticks.
    """
    dry = hand.joint_friction[i] * rate / np.sqrt(rate * rate + REST_RATE * REST_RATE)
    return hand.joint_damping[i] * rate + dry


@compiled
def joint_friction_power(hand: Record, rates: Floats) -> float:
    """Power dissipated by joint friction at given rates [W]."""
    total = 0.0
    for i in range(hand.num_fingers):
        for joint in range(rates.shape[1]):
            rate = rates[i, joint]
            total += joint_friction(hand, i, rate) * rate
    return total


@compiled
def weight_moments(hand: Record, believed: Record, kin: Record, i: int) -> tuple[float, float]:
    """Moments about both pitch axes that support the links of finger ``i`` [N m]."""
    first, second = believed.link_masses[i, 0], believed.link_masses[i, 1]
    outer = hand.gravity * second * hand.link_centres[i, 1] * kin.links[i, 1, 0]
    lever = first * hand.link_centres[i, 0] + second * hand.link_lengths[i, 0]
    return hand.gravity * lever * kin.links[i, 0, 0] + outer, outer
