"""Links and joints of fingers, as far as they are alike in the plane and in space."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record

REST_RATE = 0.01  # of a joint, below which dry friction fades [rad/s]
LEAST_SINE = 1e-2  # nearer to a straight or folded finger rounding decides on its forces


@compiled
def combine_links(truth: Record, unit: Record, total: Record) -> None:
    """Sums the links of every finger, weighted with their masses, into ``total``."""
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
    """Torque of friction against one joint of finger ``i`` that turns with a rate [N m].

    Viscous, and dry with a smooth passage through rest, so that no joint sticks.
    """
    dry = hand.joint_friction[i] * rate / np.sqrt(rate * rate + REST_RATE * REST_RATE)
    return hand.joint_damping[i] * rate + dry


@compiled
def joint_friction_power(hand: Record, rates: Floats) -> float:
    """Power lost to friction in the joints, which turn with these rates [W]."""
    total = 0.0
    for i in range(hand.num_fingers):
        for joint in range(rates.shape[1]):
            rate = rates[i, joint]
            total += joint_friction(hand, i, rate) * rate
    return total


@compiled
def weight_moments(hand: Record, believed: Record, kin: Record, i: int) -> tuple[float, float]:
    """Moments that carry the links of finger ``i``: about its first pitch and its second [N m]."""
    first, second = believed.link_masses[i, 0], believed.link_masses[i, 1]
    outer = hand.gravity * second * hand.link_centres[i, 1] * kin.links[i, 1, 0]
    lever = first * hand.link_centres[i, 0] + second * hand.link_lengths[i, 0]
    return hand.gravity * lever * kin.links[i, 0, 0] + outer, outer
