"""Fingers that are chains of two joints in the plane (docs/model.md, Finger dynamics).

The frames of the links are turned so that the inverse kinematics is that of two links, of a slide
on a link, of a link on a slide, or of two slides. Vectors are in world axes unless their frame is
named; a joint turns about z, or slides along an axis that is fixed in the previous link.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.links import LEAST_SINE
from slipgrasp.core.kernel.numerics.elementary import atan2, sincos, square

_MINIMUM, _MAXIMUM = range(2)

# Constants of one finger. Its first frame is that of link 1 at zero of the first joint.
CHAIN = np.dtype(
    [
        ("slides", np.int64, (2,)),  # 1 if the joint is prismatic
        ("origin", np.float64, (2,)),  # of joint 1, from the base [m]
        ("first", np.float64, (2,)),  # x axis of the first frame; of a prismatic joint 1, its axis
        ("second", np.float64, (2,)),  # that of link 2 at zero of joint 2, in the frame of link 1
        ("place", np.float64, (2,)),  # of joint 2 at zero, in the frame of link 1 [m]
        ("axis", np.float64, (2,)),  # of a prismatic joint 2, in the frame of link 1
        ("tip", np.float64, (2,)),  # in the frame of link 2 [m]
        ("centres", np.float64, (2, 2)),  # centres of mass in the frames of the links [m]
        ("inertias", np.float64, (2,)),  # about the centres, per mass [m^2]
        ("branch", np.float64),  # sign of the square root in the inverse kinematics
        ("middles", np.float64, (2,)),  # joint angles are within pi of these [rad]
        ("limits", np.float64, (2, 2)),  # joint limits: minimum, maximum [rad, m]
        ("limited", np.int64),  # 1 if any joint has a limit
    ],
    align=True,
)

# Directions of the links, and positions of prismatic joints.
Posture = namedtuple("Posture", "cosine1 sine1 cosine12 sine12 slide1 slide2")
# Velocity of a point of link 2 per joint rate, and vectors to it from the origins of both joints.
Lever = namedtuple("Lever", "x1 y1 x2 y2 from1_x from1_y from2_x from2_y")


@compiled
def _turn(c: float, s: float, x: float, y: float) -> tuple[float, float]:
    """A vector turned by the angle with cosine c and sine s."""
    return c * x - s * y, s * x + c * y


@compiled
def _root(squared: float) -> float:
    return np.sqrt(max(squared, 1e-300))


@compiled
def pose_chain(chain: Record, dx: float, dy: float) -> tuple[Posture, float]:
    """Inverse kinematics for a tip at (dx, dy) from the base.

    Returns:
        Posture; a squared sine that is 0 where the chain is singular: of the angle between two
        links, or of that between the motions of the tip by both joints.
    """
    dx, dy = dx - chain.origin[0], dy - chain.origin[1]
    if chain.slides[0] == 1:
        return _on_slide(chain, dx, dy)
    squared = dx * dx + dy * dy
    if chain.slides[1] == 1:
        across = chain.place[1] + chain.tip[1]
        margin = 1.0 - across * across / squared
        along = chain.branch * _root(margin * squared)
        slide, c2, s2 = along - chain.place[0] - chain.tip[0], 1.0, 0.0
    else:
        first, second = chain.place[0], chain.tip[0]
        c2 = (squared - first * first - second * second) / (2.0 * first * second)
        margin = 1.0 - c2 * c2
        s2 = chain.branch * _root(margin)
        along, across, slide = first + second * c2, second * s2, 0.0
    # Link 1 is turned from (along, across) to the tip.
    inverse = 1.0 / squared
    c1, s1 = (along * dx + across * dy) * inverse, (along * dy - across * dx) * inverse
    c12, s12 = _turn(c1, s1, c2, s2)
    return Posture(c1, s1, c12, s12, 0.0, slide), margin


@compiled
def _on_slide(chain: Record, dx: float, dy: float) -> tuple[Posture, float]:
    """As `pose_chain`, if joint 1 is prismatic."""
    c1, s1 = chain.first[0], chain.first[1]
    x, y = _turn(c1, -s1, dx, dy)
    x, y = x - chain.place[0], y - chain.place[1]
    if chain.slides[1] == 1:
        ax, ay = chain.axis[0], chain.axis[1]
        second = (y - chain.tip[1]) / ay
        return Posture(c1, s1, c1, s1, x - chain.tip[0] - ax * second, second), ay * ay
    reach = chain.tip[0]
    sine = y / reach
    margin = 1.0 - sine * sine
    cosine = chain.branch * _root(margin)
    c12, s12 = _turn(c1, s1, cosine, sine)
    return Posture(c1, s1, c12, s12, x - reach * cosine, 0.0), margin


@compiled
def lever_of(chain: Record, pose: Posture, x: float, y: float) -> Lever:
    """How the joints move the point (x, y) of link 2."""
    bx, by = _turn(pose.cosine12, pose.sine12, x, y)
    px, py = chain.place[0], chain.place[1]
    if chain.slides[1] == 1:
        px, py = px + pose.slide2 * chain.axis[0], py + pose.slide2 * chain.axis[1]
    px, py = _turn(pose.cosine1, pose.sine1, px, py)
    ax, ay = px + bx, py + by
    x1, y1, x2, y2 = -ay, ax, -by, bx
    if chain.slides[0] == 1:
        x1, y1 = chain.first[0], chain.first[1]
    if chain.slides[1] == 1:
        x2, y2 = _turn(pose.cosine1, pose.sine1, chain.axis[0], chain.axis[1])
    return Lever(x1, y1, x2, y2, ax, ay, bx, by)


@compiled
def drift_of(chain: Record, lever: Lever, rate1: float, rate2: float) -> tuple[float, float]:
    """Acceleration J' q' of a point of link 2."""
    if chain.slides[0] == 1:
        own, other, across = 0.0, square(rate2), 0.0
    else:
        own, other, across = square(rate1), (2.0 * rate1 + rate2) * rate2, 2.0 * rate1 * rate2
    if chain.slides[1] == 1:
        # The axis of the slide turns with link 1.
        return (
            -own * lever.from1_x - across * lever.y2,
            -own * lever.from1_y + across * lever.x2,
        )
    return (
        -own * lever.from1_x - other * lever.from2_x,
        -own * lever.from1_y - other * lever.from2_y,
    )


@compiled
def chain_margin(chain: Record, pose: Posture, squared: float) -> float:
    """Squared sine minus its minimum or, if smaller, a joint's distance to a limit [rad, m]."""
    least = squared - square(LEAST_SINE)
    return min(least, limit_margin(chain, pose)) if chain.limited == 1 else least


@compiled
def limit_margin(chain: Record, pose: Posture) -> float:
    """Smallest distance of a joint to its limits [rad, m]."""
    least = np.inf
    for joint in range(2):
        q = chain_position(chain, pose, joint)
        least = min(least, q - chain.limits[joint, _MINIMUM], chain.limits[joint, _MAXIMUM] - q)
    return least


@compiled
def chain_position(chain: Record, pose: Posture, joint: int) -> float:
    """Position of a joint [rad, m]."""
    if chain.slides[joint] == 1:
        return pose.slide1 if joint == 0 else pose.slide2
    if joint == 0:
        x, y = _turn(chain.first[0], -chain.first[1], pose.cosine1, pose.sine1)
    else:
        x, y = _turn(pose.cosine1, -pose.sine1, pose.cosine12, pose.sine12)
        x, y = _turn(chain.second[0], -chain.second[1], x, y)
    sine, cosine = sincos(chain.middles[joint])
    x, y = _turn(cosine, -sine, x, y)
    return chain.middles[joint] + atan2(y, x)


@compiled
def chain_unit(
    chain: Record, link: int, pose: Posture, rate1: float, rate2: float, gravity: float
) -> tuple[float, float, float, float, float]:
    """Inertia M_11, M_12, M_22 and bias h_1, h_2 of one link with a mass of 1 kg."""
    x, y = chain.centres[link, 0], chain.centres[link, 1]
    inertia = chain.inertias[link]
    if link == 0:
        if chain.slides[0] == 1:
            return 1.0, 0.0, 0.0, gravity * chain.first[1], 0.0
        side, _ = _turn(pose.cosine1, pose.sine1, x, y)
        return x * x + y * y + inertia, 0.0, 0.0, gravity * side, 0.0
    lever = lever_of(chain, pose, x, y)
    ax, ay = drift_of(chain, lever, rate1, rate2)
    x1, y1, x2, y2, ay = lever.x1, lever.y1, lever.x2, lever.y2, ay + gravity
    turns1, turns2 = 1 - chain.slides[0], 1 - chain.slides[1]
    return (
        x1 * x1 + y1 * y1 + turns1 * inertia,
        x1 * x2 + y1 * y2 + turns1 * turns2 * inertia,
        x2 * x2 + y2 * y2 + turns2 * inertia,
        x1 * ax + y1 * ay,
        x2 * ax + y2 * ay,
    )


@compiled
def chain_weight(
    chain: Record, masses: Floats, pose: Posture, gravity: float
) -> tuple[float, float]:
    """Joint torques that support the links at rest [N m, N]."""
    _, _, _, first, _ = chain_unit(chain, 0, pose, 0.0, 0.0, gravity)
    _, _, _, inner, outer = chain_unit(chain, 1, pose, 0.0, 0.0, gravity)
    return masses[0] * first + masses[1] * inner, masses[1] * outer


@compiled
def chain_heights(chain: Record, pose: Posture) -> tuple[float, float]:
    """Heights of the centres of mass of both links above the base [m]."""
    _, first = _turn(pose.cosine1, pose.sine1, chain.centres[0, 0], chain.centres[0, 1])
    lever = lever_of(chain, pose, chain.centres[1, 0], chain.centres[1, 1])
    carried = chain.origin[1]
    if chain.slides[0] == 1:
        carried += pose.slide1 * chain.first[1]
    return carried + first, carried + lever.from1_y


@compiled
def pack_chain(finger: Record, chain: Record) -> None:
    """Packs the joints of a finger, with the frames of the links turned as required."""
    inner, outer = finger.joints.entries[0], finger.joints.entries[1]
    chain.slides[0], chain.slides[1] = int(inner.kind), int(outer.kind)
    sine, cosine = sincos(finger.attitude)
    chain.origin[0], chain.origin[1] = _turn(cosine, sine, inner.place[0], inner.place[1])
    s1, c1 = sincos(finger.attitude + inner.attitude)
    s2, c2 = sincos(outer.attitude)
    ax, ay = _unit(outer.axis[0], outer.axis[1])
    ax, ay = _turn(c2, s2, ax, ay)
    # New x axes of the links, in their frames.
    if chain.slides[0] == 1:
        ux, uy = _unit(inner.axis[0], inner.axis[1])
    elif chain.slides[1] == 1:
        ux, uy = ax, ay
    else:
        ux, uy = _unit(outer.place[0], outer.place[1])
    if chain.slides[1] == 1:
        vx, vy = _turn(c2, -s2, ux, uy)
    else:
        vx, vy = _unit(finger.tip[0], finger.tip[1])
    chain.first[0], chain.first[1] = _turn(c1, s1, ux, uy)
    wx, wy = _turn(c2, s2, vx, vy)
    chain.second[0], chain.second[1] = _turn(ux, -uy, wx, wy)
    chain.place[0], chain.place[1] = _turn(ux, -uy, outer.place[0], outer.place[1])
    chain.axis[0], chain.axis[1] = _turn(ux, -uy, ax, ay)
    chain.tip[0], chain.tip[1] = _turn(vx, -vy, finger.tip[0], finger.tip[1])
    chain.centres[0, 0], chain.centres[0, 1] = _turn(ux, -uy, inner.centre[0], inner.centre[1])
    chain.centres[1, 0], chain.centres[1, 1] = _turn(vx, -vy, outer.centre[0], outer.centre[1])
    chain.inertias[0], chain.inertias[1] = inner.unit_inertia, outer.unit_inertia
    _pack_limits(finger, chain)
    chain.branch = _branch(chain, finger.posture[1])


@compiled
def _unit(x: float, y: float) -> tuple[float, float]:
    """A vector of length 1; zero stays zero."""
    length = np.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (x, y)


@compiled
def _branch(chain: Record, posture: float) -> float:
    """Sign of the square root in the inverse kinematics, for a position of joint 2."""
    if chain.slides[1] == 1:
        value = chain.place[0] + chain.tip[0] + posture
    else:
        sine, cosine = sincos(posture)
        cosine, sine = _turn(cosine, sine, chain.second[0], chain.second[1])
        value = cosine if chain.slides[0] == 1 else sine
    return -1.0 if value < 0.0 else 1.0


@compiled
def _pack_limits(finger: Record, chain: Record) -> None:
    chain.limited = 0
    for k in range(2):
        joint = finger.joints.entries[k]
        low, high = joint.minimum, joint.maximum
        chain.middles[k] = finger.posture[k]
        if low == low and high == high:
            chain.middles[k] = 0.5 * (low + high)
        chain.limits[k, _MINIMUM] = low if low == low else -np.inf
        chain.limits[k, _MAXIMUM] = high if high == high else np.inf
        if low == low or high == high:
            chain.limited = 1
