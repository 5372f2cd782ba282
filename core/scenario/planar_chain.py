"""Joint positions of a planar chain in closed form (docs/model.md, Finger dynamics)."""

from __future__ import annotations

import cmath
import math
from typing import NamedTuple

from slipgrasp.core.scenario.chain import PlanarJoint
from slipgrasp.core.scenario.finger import FingerParameters


class ChainStart(NamedTuple):
    """Joint positions of a chain whose tip is at a point.

    Attributes:
        positions: Of both joints [rad, m].
        sine: Sine of the angle between the motions of the tip by the two joints, 0 if singular.
    """

    positions: tuple[float, float]
    sine: float


def planar_chain_start(finger: FingerParameters, tip: tuple[float, float]) -> ChainStart | None:
    """Joint positions on the branch of the posture; None if the tip is out of reach.

    Args:
        finger: A finger with two joints. Complex numbers are vectors in the plane.
        tip: Position of the tip relative to the base [m].
    """
    first, second = finger.joints
    turn, bend = cmath.rect(1.0, finger.attitude), cmath.rect(1.0, second.attitude)
    target = (complex(*tip) / turn - complex(*first.place)) / cmath.rect(1.0, first.attitude)
    place, reach = complex(*second.place), bend * complex(*finger.tip)
    axis, moved = _unit(first), bend * _unit(second)
    if first.kind == second.kind == "prismatic":
        return _on_two_slides(target - place - reach, axis, moved)
    if first.kind == "prismatic":
        return _on_slide(finger, (target - place) / axis, reach / axis)
    if second.kind == "prismatic":
        offset = (place + reach) / moved
        sine = _sine(offset.imag, abs(target))
        if sine is None:
            return None
        along = math.copysign(sine * abs(target), offset.real + finger.posture[1])
        angle = cmath.phase(target / (moved * complex(along, offset.imag)))
        return ChainStart((_near(finger, 0, angle), along - offset.real), sine)
    return _on_two_links(finger, target, place, reach)


def centre_of(finger: FingerParameters, joint: int) -> float:
    """Middle of the limits of a revolute joint, else its posture: angles are within pi of it."""
    low, high = finger.joints[joint].minimum, finger.joints[joint].maximum
    return finger.posture[joint] if low is None or high is None else 0.5 * (low + high)


def _on_two_slides(rest: complex, axis: complex, moved: complex) -> ChainStart | None:
    sine = (axis.conjugate() * moved).imag
    if sine == 0.0:
        return None
    second = (axis.conjugate() * rest).imag / sine
    return ChainStart(((axis.conjugate() * (rest - second * moved)).real, second), abs(sine))


def _on_slide(finger: FingerParameters, target: complex, reach: complex) -> ChainStart | None:
    """A slide along x that carries a link."""
    cosine = _sine(target.imag, abs(reach))
    if cosine is None:
        return None
    offset = cmath.phase(reach)
    along = math.copysign(cosine * abs(reach), math.cos(offset + finger.posture[1]))
    angle = math.atan2(target.imag, along) - offset
    return ChainStart((target.real - along, _near(finger, 1, angle)), cosine)


def _on_two_links(
    finger: FingerParameters, target: complex, place: complex, reach: complex
) -> ChainStart | None:
    product = 2.0 * abs(place) * abs(reach)
    if product == 0.0:
        return None
    cosine = (abs(target) ** 2 - abs(place) ** 2 - abs(reach) ** 2) / product
    sine, offset = _sine(cosine, 1.0), cmath.phase(reach / place)
    if sine is None:
        return None
    bend = math.atan2(math.copysign(sine, math.sin(offset + finger.posture[1])), cosine) - offset
    angle = cmath.phase(target / (place + reach * cmath.rect(1.0, bend)))
    return ChainStart((_near(finger, 0, angle), _near(finger, 1, bend)), sine)


def _sine(side: float, longest: float) -> float | None:
    """Sine of the angle whose cosine is side / longest; None if the side is longer."""
    if abs(side) > longest or longest == 0.0:
        return None
    return math.sqrt(1.0 - (side / longest) ** 2)


def _near(finger: FingerParameters, joint: int, angle: float) -> float:
    centre = centre_of(finger, joint)
    return centre + math.remainder(angle - centre, 2.0 * math.pi)


def _unit(joint: PlanarJoint) -> complex:
    axis = complex(*joint.axis)
    return axis / abs(axis)
