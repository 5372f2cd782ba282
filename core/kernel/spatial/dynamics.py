"""Finger dynamics at the fingertips of spatial hands, link by link.

A tip acceleration a requires the joint torques that correspond to the tip force f = Lambda a + f_0,
in world axes. Lambda (symmetric: xx, xy, xz, yy, yz, zz) and f_0 are sums over links of mass times
a unit part, as for planar hands. The yaw axis is decoupled in the inertia: it adds M_yaw / radius^2
across the plane of the finger. On slides, Lambda is the moving mass and f_0 its weight.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Record
from slipgrasp.core.kernel.loop.links import BY_CHAIN, ON_SLIDES, joint_friction
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.chain_dynamics import see_at_tip, weigh_chain
from slipgrasp.core.kernel.spatial.kinematics import KINEMATICS
from slipgrasp.core.kernel.spatial.model import HAND, TRUTH
from slipgrasp.core.kernel.spatial.state import POSITION, SPIN, VELOCITY
from slipgrasp.core.scenario.chain import MAX_LINKS

# Apparent inertia and bias force of the fingers at their tips.
TIP_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, 6)),  # Lambda [kg]
        ("bias", np.float64, (MAX_FINGERS, 3)),  # f_0 [N]
    ],
    align=True,
)

# Lambda [1] and f_0 [N/kg] per link mass; indices: finger, link, component.
UNIT_DYNAMICS = np.dtype(
    [
        ("inertia", np.float64, (MAX_FINGERS, MAX_LINKS, 6)),
        ("bias", np.float64, (MAX_FINGERS, MAX_LINKS, 3)),
    ],
    align=True,
)


@compiled
def joint_inertia(
    hand: Record, kin: Record, i: int, link: int
) -> tuple[float, float, float, float]:
    """M_yaw, M_22, M_23, M_33 of one link with a mass of 1 kg."""
    centre, moment = hand.link_centres[i, link], hand.link_moments[i, link]
    if link == 0:
        return moment * square(kin.links[i, 0, 0]), moment, 0.0, 0.0
    first = hand.link_lengths[i, 0]
    coupling = first * centre * kin.bends[i, 0]
    reach = first * kin.links[i, 0, 0] + centre * kin.links[i, 1, 0]
    yaw = square(reach) + hand.own_moments[i, 1] * square(kin.links[i, 1, 0])
    return yaw, first * first + moment + 2.0 * coupling, moment + coupling, moment


@compiled
def joint_bias(hand: Record, kin: Record, i: int, link: int) -> tuple[float, float, float]:
    """Gravity, centrifugal and Coriolis torques h_1, h_2, h_3 of one link with a mass of 1 kg."""
    centre, moment = hand.link_centres[i, link], hand.link_moments[i, link]
    yaw, rate1, rate2 = kin.rates[i, 0], kin.rates[i, 1], kin.rates[i, 2]
    c1, s1 = kin.links[i, 0, 0], kin.links[i, 0, 1]
    c12, s12 = kin.links[i, 1, 0], kin.links[i, 1, 1]
    if link == 0:
        slope = -2.0 * moment * c1 * s1  # of M_yaw along q2
        return (
            slope * rate1 * yaw,
            hand.gravity * centre * c1 - 0.5 * slope * yaw * yaw,
            0.0,
        )
    first = hand.link_lengths[i, 0]
    weight = hand.gravity * centre * c12
    centrifugal = first * centre * kin.bends[i, 1]
    reach = first * c1 + centre * c12
    own = -2.0 * hand.own_moments[i, 1] * c12 * s12
    slope1 = -2.0 * reach * (first * s1 + centre * s12) + own  # of M_yaw along q2 and q3
    slope2 = -2.0 * reach * centre * s12 + own
    return (
        (slope1 * rate1 + slope2 * rate2) * yaw,
        hand.gravity * first * c1
        + weight
        - centrifugal * (2.0 * rate1 + rate2) * rate2
        - 0.5 * slope1 * yaw * yaw,
        weight + centrifugal * rate1 * rate1 - 0.5 * slope2 * yaw * yaw,
    )


@compiled
def _see_chain(
    hand: Record, masses: Floats, kin: Record, i: int, tip_inertia: Floats, tip_bias: Floats
) -> None:
    """Computes Lambda and f_0 of chain ``i`` for given link masses."""
    now = kin.chains[i]
    weigh_chain(hand.chains[i], masses, hand.gravity, now)
    see_at_tip(now.inverse, now.inertia, now.bias, kin.curvature[i], tip_inertia, tip_bias)


# Chains are compiled separately, as in `slipgrasp.core.kernel.spatial.kinematics`.
@compiled_apart(types.void, HAND, TRUTH, KINEMATICS, types.int64, TIP_DYNAMICS)
def spatial_see_chain(hand: Record, truth: Record, kin: Record, i: int, total: Record) -> None:
    """Computes Lambda and f_0 of chain ``i``."""
    _see_chain(hand, truth.link_masses[i], kin, i, total.inertia[i], total.bias[i])


@compiled_apart(types.void, HAND, KINEMATICS, types.int64, UNIT_DYNAMICS)
def spatial_see_links(hand: Record, kin: Record, i: int, unit: Record) -> None:
    """Computes Lambda and f_0 of chain ``i`` for a mass of 1 kg on each link in turn."""
    masses = kin.chains[i].masses
    for link in range(hand.chains[i].links):
        for k in range(MAX_LINKS):
            masses[k] = 1.0 if k == link else 0.0
        _see_chain(hand, masses, kin, i, unit.inertia[i, link], unit.bias[i, link])


@compiled
def update_unit_dynamics(hand: Record, kin: Record, unit: Record) -> None:
    """Fills ``unit`` for the positions and velocities in ``kin``."""
    for i in range(hand.num_fingers):
        if hand.kinds[i] == ON_SLIDES:
            _set_slides(1.0, hand.gravity, unit.inertia[i, 0], unit.bias[i, 0])
            continue
        if hand.kinds[i] == BY_CHAIN:
            spatial_see_links(hand, kin, i, unit)
            continue
        for link in range(2):
            inertia = joint_inertia(hand, kin, i, link)
            bias = joint_bias(hand, kin, i, link)
            _see_at_tip(kin, i, inertia, bias, unit.inertia[i, link], unit.bias[i, link])


@compiled
def update_tip_dynamics(hand: Record, truth: Record, kin: Record, total: Record) -> None:
    """Fills ``total`` directly for each finger, faster than link by link."""
    for i in range(hand.num_fingers):
        first, second = truth.link_masses[i, 0], truth.link_masses[i, 1]
        if hand.kinds[i] == ON_SLIDES:
            _set_slides(first, hand.gravity * first, total.inertia[i], total.bias[i])
            continue
        if hand.kinds[i] == BY_CHAIN:
            spatial_see_chain(hand, truth, kin, i, total)
            continue
        a, b = joint_inertia(hand, kin, i, 0), joint_inertia(hand, kin, i, 1)
        c, d = joint_bias(hand, kin, i, 0), joint_bias(hand, kin, i, 1)
        inertia = (
            first * a[0] + second * b[0],
            first * a[1] + second * b[1],
            first * a[2] + second * b[2],
            first * a[3] + second * b[3],
        )
        bias = (
            first * c[0] + second * d[0],
            first * c[1] + second * d[1],
            first * c[2] + second * d[2],
        )
        _see_at_tip(kin, i, inertia, bias, total.inertia[i], total.bias[i])


@compiled
def _set_slides(mass: float, weight: float, inertia: Floats, bias: Floats) -> None:
    """Sets Lambda and f_0 of a mass on slides."""
    inertia[0] = inertia[3] = inertia[5] = mass
    inertia[1] = inertia[2] = inertia[4] = 0.0
    bias[0], bias[1], bias[2] = 0.0, 0.0, weight


@compiled
def _see_at_tip(
    kin: Record,
    i: int,
    inertia: tuple[float, float, float, float],
    bias: tuple[float, float, float],
    tip_inertia: Floats,
    tip_bias: Floats,
) -> None:
    """Computes Lambda and f_0 of finger ``i`` from its M and h."""
    yaw, m11, m12, m22 = inertia
    h0, h1, h2 = bias
    i00, i01 = kin.inverses[i, 0, 0], kin.inverses[i, 0, 1]
    i10, i11 = kin.inverses[i, 1, 0], kin.inverses[i, 1, 1]
    cosine, sine, radius = kin.yaws[i, 0], kin.yaws[i, 1], kin.reaches[i, 0]
    # M J^-1: pitch torques per outward and upward tip acceleration.
    x1, x2 = m11 * i00 + m12 * i10, m12 * i00 + m22 * i10
    y1, y2 = m11 * i01 + m12 * i11, m12 * i01 + m22 * i11
    out, lift, up = i00 * x1 + i10 * x2, i00 * y1 + i10 * y2, i01 * y1 + i11 * y2
    side = yaw / (radius * radius)
    tip_inertia[0] = out * cosine * cosine + side * sine * sine
    tip_inertia[1] = (out - side) * cosine * sine
    tip_inertia[2] = lift * cosine
    tip_inertia[3] = out * sine * sine + side * cosine * cosine
    tip_inertia[4] = lift * sine
    tip_inertia[5] = up
    outwards, across = i00 * h1 + i10 * h2, h0 / radius
    bx, by, bz = kin.curvature[i, 0], kin.curvature[i, 1], kin.curvature[i, 2]
    ax, ay, az = multiply(tip_inertia, bx, by, bz)
    tip_bias[0] = cosine * outwards - sine * across - ax
    tip_bias[1] = sine * outwards + cosine * across - ay
    tip_bias[2] = i01 * h1 + i11 * h2 - az


@compiled
def add_joint_friction(hand: Record, kin: Record, total: Record) -> None:
    """Adds joint friction, mapped to the tip by J^-T, to the bias forces f_0."""
    for i in range(hand.num_fingers):
        if hand.kinds[i] == ON_SLIDES:
            for c in range(3):
                total.bias[i, c] += joint_friction(hand, i, kin.rates[i, c])
            continue
        if hand.kinds[i] == BY_CHAIN:
            for k in range(3):
                taken = joint_friction(hand, i, kin.rates[i, k])
                for c in range(3):
                    total.bias[i, c] += kin.chains[i].inverse[k, c] * taken
            continue
        yaw = joint_friction(hand, i, kin.rates[i, 0]) / kin.reaches[i, 0]
        first = joint_friction(hand, i, kin.rates[i, 1])
        second = joint_friction(hand, i, kin.rates[i, 2])
        outwards = kin.inverses[i, 0, 0] * first + kin.inverses[i, 1, 0] * second
        cosine, sine = kin.yaws[i, 0], kin.yaws[i, 1]
        total.bias[i, 0] += cosine * outwards - sine * yaw
        total.bias[i, 1] += sine * outwards + cosine * yaw
        total.bias[i, 2] += kin.inverses[i, 0, 1] * first + kin.inverses[i, 1, 1] * second


@compiled
def multiply(matrix: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Product of a symmetric 3x3 matrix (xx, xy, xz, yy, yz, zz) and a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[1] * x + matrix[3] * y + matrix[4] * z,
        matrix[2] * x + matrix[4] * y + matrix[5] * z,
    )


@compiled
def world_inertia(kin: Record, inertias: Floats, entries: Floats) -> None:
    """Computes R I_b R^T of the object, six entries."""
    k = 0
    for a in range(3):
        for b in range(a, 3):
            total = 0.0
            for c in range(3):
                total += inertias[c] * (kin.rotation[a, c] * kin.rotation[b, c])
            entries[k] = total
            k += 1


@compiled
def stored_energy(hand: Record, truth: Record, kin: Record, state: Record) -> tuple[float, float]:
    """Kinetic and potential energy [J] of object and fingers; potential 0 at z = 0."""
    x, rotation = state.x, kin.rotation
    kinetic, potential = 0.0, hand.gravity * truth.object_mass * x[POSITION + 2]
    for k in range(3):
        about = 0.0
        for c in range(3):
            about += rotation[c, k] * x[SPIN + c]
        kinetic += 0.5 * (truth.object_mass * square(x[VELOCITY + k]))
        kinetic += 0.5 * (truth.inertias[k] * square(about))
    for i in range(hand.num_fingers):
        yaw, rate1, rate2 = kin.rates[i, 0], kin.rates[i, 1], kin.rates[i, 2]
        joint_height = hand.bases[i, 2]
        if hand.kinds[i] == ON_SLIDES:
            mass = truth.link_masses[i, 0]
            kinetic += 0.5 * mass * (yaw * yaw + rate1 * rate1 + rate2 * rate2)
            potential += hand.gravity * mass * (joint_height + kin.positions[i, 2])
            continue
        if hand.kinds[i] == BY_CHAIN:
            now = kin.chains[i]
            mass, moment = weigh_chain(hand.chains[i], truth.link_masses[i], hand.gravity, now)
            x, y, z = multiply(now.inertia, yaw, rate1, rate2)
            kinetic += 0.5 * (yaw * x + rate1 * y + rate2 * z)
            potential += hand.gravity * (mass * joint_height + moment)
            continue
        for link in range(2):
            mass = truth.link_masses[i, link]
            m0, m11, m12, m22 = joint_inertia(hand, kin, i, link)
            moving = m11 * rate1 * rate1 + 2.0 * m12 * rate1 * rate2 + m22 * rate2 * rate2
            height = joint_height + hand.link_centres[i, link] * kin.links[i, link, 1]
            kinetic += 0.5 * mass * (moving + m0 * yaw * yaw)
            potential += hand.gravity * mass * height
            joint_height += hand.link_lengths[i, link] * kin.links[i, link, 1]
    return kinetic, potential
